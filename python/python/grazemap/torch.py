"""Returns as functions that PyTorch differentiates and maps over rows.

Needs PyTorch (extra ``torch``), which is imported when a function is made. Numbers are computed in
double precision on the processor and given in the precision and on the device of the arguments.
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
    """Give the return by a local map as a function that PyTorch differentiates once.

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
    >>> import torch  # doctest: +SKIP
    >>> returned = gm.torch.map_return(gm.Scene.catalogue("linear"))  # doctest: +SKIP
    >>> state = torch.tensor([0.0, 1e-6], requires_grad=True)  # doctest: +SKIP
    >>> returned(state).sum().backward()  # doctest: +SKIP
    >>> state.grad.shape  # doctest: +SKIP
    torch.Size([2])

    """
    return _function(MapReturn(source))


def direct_return(
    source: Source,
    parameters: str | Iterable[str] | None = None,
    *,
    returns: int = 1,
    at: float | None = None,
) -> Callable[..., Any]:
    """Give the return by direct simulation as a function that PyTorch differentiates, to order 8.

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
    >>> import torch  # doctest: +SKIP
    >>> returned = gm.torch.direct_return(gm.Scene.catalogue("linear"), "r")  # doctest: +SKIP
    >>> start = torch.tensor([0.0, 3.0, 0.0])  # doctest: +SKIP
    >>> torch.func.jacrev(returned)(start).shape  # doctest: +SKIP
    torch.Size([3, 3])

    """
    return _function(DirectReturn(source, parameters, returns, at))


def _function(of: Return) -> Callable[..., Any]:
    """Make a function of states and parameters of a return."""
    import torch

    jets = _jets()

    def returned(states: Any, parameters: Any = None) -> Any:
        given = (states, of.values if parameters is None else parameters)
        kinds = [torch.as_tensor(one).dtype for one in given if hasattr(one, "dtype")]
        real = [kind for kind in kinds if kind.is_floating_point] or [torch.get_default_dtype()]
        kind = functools.reduce(torch.promote_types, real)
        device = next((one.device for one in given if isinstance(one, torch.Tensor)), None)
        rows = [torch.as_tensor(one, dtype=kind, device=device) for one in given]
        ahead = of.check(*(tuple(one.shape) for one in rows))
        rows = [one.expand(*ahead, one.shape[-1]) for one in rows]
        return jets.apply(torch.cat(rows, dim=-1), of, 0)[0]

    return returned


@functools.cache
def _jets() -> Any:
    """Make the function of rows to the values and the derivatives up to an order."""
    import torch

    class Jets(torch.autograd.Function):
        """Values and derivatives of a return up to an order."""

        @staticmethod
        def forward(rows: Any, of: Return, order: int) -> tuple[Any, ...]:
            found = of.jets(rows.detach().cpu().numpy().astype(np.float64), order)
            return tuple(
                torch.as_tensor(one, dtype=rows.dtype, device=rows.device) for one in found
            )

        @staticmethod
        def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[Any, ...]) -> None:
            del output
            rows, ctx.of, ctx.order = inputs
            ctx.save_for_backward(rows)
            ctx.save_for_forward(rows)

        @staticmethod
        def backward(ctx: Any, *changes: Any) -> tuple[Any, None, None]:
            (rows,) = ctx.saved_tensors
            _, *tensors = Jets.apply(rows, ctx.of, ctx.order + 1)
            variables = rows.shape[-1]
            parts = (
                (change.unsqueeze(-1) * tensor).reshape(*rows.shape[:-1], -1, variables).sum(-2)
                for change, tensor in zip(changes, tensors, strict=True)
            )
            return sum(parts), None, None

        @staticmethod
        def jvp(ctx: Any, change: Any, *_: None) -> tuple[Any, ...]:
            (rows,) = ctx.saved_tensors
            _, *tensors = Jets.apply(rows, ctx.of, ctx.order + 1)
            return tuple(along(tensor, change, one) for one, tensor in enumerate(tensors, 1))

        @staticmethod
        def vmap(
            _info: Any, dims: tuple[int | None, ...], rows: Any, of: Return, order: int
        ) -> tuple[tuple[Any, ...], tuple[int, ...]]:
            found = Jets.apply(rows.movedim(dims[0], 0), of, order)
            return found, (0,) * len(found)

    return Jets
