use grazemap::analysis::NoProgress;
use grazemap::convergence::*;
fn main() {
    let only = std::env::args().nth(1).unwrap_or_default();
    let cases: Vec<_> = extreme_cases().into_iter().filter(|c| only.is_empty() || c.axis.stem() == only).collect();
    for case in &cases {
        let t = std::time::Instant::now();
        let row = extremes(std::slice::from_ref(case), &NoProgress).rows.remove(0);
        let time = t.elapsed().as_secs_f64();
        match &row.outcome {
            ExtremeOutcome::Measured(m) => println!("{:14} {:9.1e} {:8} d={:.0e} N={} W={} graze {:?} contact {:.1} (truth {:.1}; trunc {:.1} round {:.1}) map {:.1?} (truth {:.1}; leg round {:.1} trunc {:.1}) {:.1}s {}",
                row.axis.stem(), row.value, row.scene, row.depth, row.orders.smooth_order, row.orders.contact_weight, m.grazing.map(|g| g.round()), m.contact, m.contact_truth, m.truncation, m.rounding, m.map, m.map_truth, m.leg_rounding, m.leg_truncation, time, if m.is_silent_loss() {"SILENT"} else {""}),
            ExtremeOutcome::Refused{stage, message} => println!("{:14} {:9.1e} {:8} REFUSED {stage}: {message} {:.1}s", row.axis.stem(), row.value, row.scene, time),
        }
    }
}
