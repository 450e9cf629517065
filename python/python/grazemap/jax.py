"""Returns as functions that JAX differentiates, compiles and maps over rows.

Needs JAX (extra ``jax``), which is imported when a function is made. Numbers have the precision of
the arguments: single unless ``jax_enable_x64`` is set.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import numpy as np

from ._differentiable import DirectReturn, MapReturn, Return, along

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from ._commands import Source

__all__ = ["direct_return", "map_return"]


def map_return(source: Source) -> Callable[..., Any]:
    """Give the return by a local map as a function that JAX differentiates once.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.

    Returns
    -------
    Callable
        Function of offsets of states, shape ``(..., coordinates)``, and of active parameters,
        shape ``(..., parameters)`` (default: 0), as a call of the map. It gives the images.

    Raises
    ------
    NoResultError
        The scene has no grazing orbit. Of the function: a passage grazes, and a derivative does
        not exist.
    InputError
        Of the function: array of a wrong shape, or a second derivative.

    Examples
    --------
    >>> import grazemap as gm
    >>> import jax  # doctest: +SKIP
    >>> returned = gm.jax.map_return(gm.Scene.catalogue("linear"))  # doctest: +SKIP
    >>> jax.jacobian(returned)(jax.numpy.array([0.0, 1e-6])).shape  # doctest: +SKIP
    (2, 2)

    """
    return _function(MapReturn(source))


def direct_return(
    source: Source,
    parameters: str | Iterable[str] | None = None,
    *,
    returns: int = 1,
    at: float | None = None,
) -> Callable[..., Any]:
    """Give the return by direct simulation as a function that JAX differentiates, to order 8.

    Every stop acts; derivatives are those of :func:`grazemap.derivatives`.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`; values that are not arguments of the
        function are those of the scene.
    parameters
        Parameters that are arguments of the function. Default: the active ones of the scene.
    returns
        Number of forcing periods, 1 to 1 000 000.
    at
        Time of the end, above 0. Default: that of ``returns``.

    Returns
    -------
    Callable
        Function of states with the phase, shape ``(..., states)``, and of parameters, shape
        ``(..., parameters)`` (default: those of the scene), as values. It gives the states at
        the end; the phase is not reduced.

    Raises
    ------
    InputError
        Wrong argument; the message names it. Of the function: array of a wrong shape.
    NoResultError
        Of the function: the trajectory grazes, two stops act at once, or it rebounds without end.

    Examples
    --------
    >>> import grazemap as gm
    >>> import jax  # doctest: +SKIP
    >>> returned = gm.jax.direct_return(gm.Scene.catalogue("linear"), "r")  # doctest: +SKIP
    >>> jax.hessian(returned)(jax.numpy.array([0.0, 3.0, 0.0])).shape  # doctest: +SKIP
    (3, 3, 3)

    """
    return _function(DirectReturn(source, parameters, returns, at))


def _function(of: Return) -> Callable[..., Any]:
    """Make a function of states and parameters of a return."""
    import jax
    import jax.numpy as jnp

    @functools.cache
    def jets(order: int) -> Any:
        """Give the function of rows to the values and the derivatives up to an order."""
        shapes = of.shapes(order)

        def found(rows: Any) -> tuple[Any, ...]:
            kept = of.jets(np.asarray(rows, np.float64), order)
            return tuple(np.asarray(one, rows.dtype) for one in kept)

        def at(rows: Any) -> tuple[Any, ...]:
            if not isinstance(rows, jax.core.Tracer):
                # Exceptions pass as they are.
                return tuple(map(jnp.asarray, found(rows)))
            ahead = rows.shape[:-1]
            kinds = tuple(jax.ShapeDtypeStruct((*ahead, *shape), rows.dtype) for shape in shapes)
            return tuple(jax.pure_callback(found, kinds, rows, vmap_method="broadcast_all"))

        def rule(
            primals: tuple[Any], tangents: tuple[Any]
        ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
            (rows,), (change,) = primals, tangents
            values = jets(order + 1)(rows)
            changes = (along(tensor, change, one) for one, tensor in enumerate(values[1:], 1))
            return values[:-1], tuple(changes)

        differentiable = jax.custom_jvp(at)
        differentiable.defjvp(rule)
        return differentiable

    def returned(states: Any, parameters: Any = None) -> Any:
        states = jnp.asarray(states)
        if parameters is None:
            parameters = jnp.asarray(of.values, jnp.result_type(states, float))
        parameters = jnp.asarray(parameters)
        kind = jnp.result_type(states, parameters, float)
        ahead = of.check(states.shape, parameters.shape)
        rows = [
            jnp.broadcast_to(one, (*ahead, one.shape[-1])).astype(kind)
            for one in (states, parameters)
        ]
        return jets(0)(jnp.concatenate(rows, axis=-1))[0]

    return returned
