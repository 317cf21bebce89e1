"""Processor instructions for kernels that numba does not provide: `prefetch` and `store`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cdtool.kernels import Kernel


class _Instruction(Kernel):
    """Used in kernels like another kernel; there is nothing to compile, and numba is loaded only on use."""

    def __init__(self, function: Callable[..., Any], made: Callable[[], Callable[..., Any]]) -> None:
        super().__init__(function, "")
        self._made = made

    @property
    def compiled(self) -> Callable[..., Any]:
        """Return the numba function for use in a kernel."""
        if self._compiled is None:
            self._compiled = self._made()
        return self._compiled


def _prefetch(data: Any, at: int) -> None:
    """Fetch the cache line of byte `at` after the first one of the array `data`; any address is allowed.

    A kernel that reads a few bytes here and there from much memory mostly waits for memory. If it announces the next
    addresses some elements ahead, the processor fetches them meanwhile: reading numbers from messages takes less than
    half the time.
    """


def _emit_prefetch() -> Callable[..., Any]:
    from llvmlite import ir  # type: ignore[import-untyped]
    from numba import types
    from numba.extending import intrinsic

    def emit(_: Any, data: Any, at: Any) -> Any:
        def lines(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = context.make_array(signature.args[0])(context, builder, arguments[0])
            byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
            kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
            instruction = builder.module.declare_intrinsic("llvm.prefetch", [byte], kind)
            place = builder.gep(builder.bitcast(array.data, byte), [arguments[1]])
            # Parameters: read (0), highest locality (3), data (1).
            builder.call(instruction, [place, number(0), number(3), number(1)])
            return context.get_dummy_value()

        return types.void(data, at), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


def _store(address: int, value: Any) -> None:
    """Write a number to an address, which must be that of such a number in an array that is kept alive.

    A kernel takes a fixed number of arrays, but the number of columns varies.
    """


def _emit_store() -> Callable[..., Any]:
    from numba import types
    from numba.extending import intrinsic

    def emit(_: Any, address: Any, value: Any) -> Any:
        def lines(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            pointer = context.get_value_type(signature.args[1]).as_pointer()
            builder.store(arguments[1], builder.inttoptr(arguments[0], pointer))
            return context.get_dummy_value()

        return types.void(address, value), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


prefetch = _Instruction(_prefetch, _emit_prefetch)
store = _Instruction(_store, _emit_store)
