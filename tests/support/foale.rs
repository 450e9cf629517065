//! Foale's closed form of one-impact orbits of the linear oscillator (1994;
//! tests/data/rigid/README.md).

use grazemap::numeric::Dd;

/// Foale's closed form: `x'' + 2ζ x' + x = α cos ωt`, stop at 1, one impact in `returns` periods of
/// the forcing.
pub(crate) struct Foale {
    omega: Dd,
    zeta: Dd,
    r: Dd,
    p: Dd,
    q: Dd,
    m12: Dd,
    trace: Dd,
    decay: Dd,
}

impl Foale {
    pub(crate) fn new(omega: Dd, zeta: Dd, r: Dd, returns: usize) -> Self {
        let time = Dd::PI * Dd::from(2.0 * returns as f64) / omega;
        let damped = (Dd::ONE - zeta * zeta).sqrt();
        let (sin, cos) = (damped * time).sin_cos();
        let decay = (-zeta * time).exp();
        let m11 = decay * (cos + zeta * sin / damped);
        let m22 = decay * (cos - zeta * sin / damped);
        let m12 = decay * sin / damped;
        let det = (m11 - Dd::ONE) * (m22 - Dd::ONE) + m12 * m12;
        Self {
            omega,
            zeta,
            r,
            p: -(Dd::ONE + r) * m12 / det,
            q: (Dd::ONE + r) * (m11 - Dd::ONE) / det,
            m12,
            trace: m11 + m22,
            decay,
        }
    }

    /// Closed form at named parameters, with an offset `unfolding` of the frequency.
    pub(crate) fn unfolded(parameter: impl Fn(&str) -> Dd, unfolding: f64, returns: usize) -> Self {
        let omega = parameter("omega") + Dd::from(unfolding);
        Self::new(omega, parameter("zeta"), parameter("r"), returns)
    }

    pub(crate) fn gain(&self) -> Dd {
        let stiff = Dd::ONE - self.omega * self.omega;
        let damped = Dd::from(2.0) * self.zeta * self.omega;
        (stiff * stiff + damped * damped).sqrt()
    }

    fn square(&self) -> Dd {
        let slope = (self.q + self.r) / self.omega;
        self.p * self.p + slope * slope
    }

    pub(crate) fn alpha(&self, speed: Dd) -> Dd {
        let square = Dd::ONE - Dd::from(2.0) * self.p * speed + self.square() * speed * speed;
        self.gain() * square.sqrt()
    }

    /// Impact speeds of the two orbits at an amplitude, the smaller first.
    pub(crate) fn speeds(&self, alpha: Dd) -> [Dd; 2] {
        let rest = Dd::ONE - alpha * alpha / (self.gain() * self.gain());
        let root = (self.p * self.p - self.square() * rest).sqrt();
        [self.p - root, self.p + root].map(|speed| speed / self.square())
    }

    /// Smaller positive impact speed of the orbits at an amplitude.
    pub(crate) fn speed(&self, alpha: Dd) -> Dd {
        let [below, above] = self.speeds(alpha);
        if below > Dd::ZERO { below } else { above }
    }

    fn constant(&self) -> Dd {
        let stiff = Dd::ONE - self.omega * self.omega;
        stiff * self.p + Dd::from(2.0) * self.zeta * (self.q + self.r)
    }

    pub(crate) fn trace(&self, speed: Dd) -> Dd {
        let kick = self.omega * self.omega / speed + self.constant();
        -self.r * self.trace - (Dd::ONE + self.r) * self.m12 * kick
    }

    pub(crate) fn determinant(&self) -> Dd {
        (self.r * self.decay) * (self.r * self.decay)
    }

    pub(crate) fn fold(&self) -> Dd {
        self.alpha(self.fold_speed())
    }

    pub(crate) fn fold_speed(&self) -> Dd {
        self.p / self.square()
    }

    pub(crate) fn flip(&self) -> Dd {
        self.alpha(self.flip_speed())
    }

    pub(crate) fn flip_speed(&self) -> Dd {
        let kick = (Dd::ONE + self.r) * self.m12;
        let rest = Dd::ONE + self.determinant() - self.r * self.trace - kick * self.constant();
        kick * self.omega * self.omega / rest
    }
}
