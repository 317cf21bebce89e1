"""Instructions of the processor that kernels need and numba has no word for: `prefetch` and `store`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cdtool.kernels import Kernel


class _Instruction(Kernel):
    """Stands in kernels like another kernel; there is nothing to compile, and numba is loaded only where it is used."""

    def __init__(self, function: Callable[..., Any], made: Callable[[], Callable[..., Any]]) -> None:
        super().__init__(function, "")
        self._made = made

    @property
    def compiled(self) -> Callable[..., Any]:
        """What numba makes of it in a kernel."""
        if self._compiled is None:
            self._compiled = self._made()
        return self._compiled


def _prefetch(data: Any, at: int) -> None:
    """Fetch the cache line of byte `at` after the first one of the array `data`; it need not exist. Changes nothing.

    A kernel that picks a few bytes here and there out of much memory waits for memory most of its time. Told some
    elements ahead which places come next, the processor fetches them meanwhile: picking numbers out of messages takes
    less than half as long.
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
            # To be read (0), with as much locality as there is (3), data (1).
            builder.call(instruction, [place, number(0), number(3), number(1)])
            return context.get_dummy_value()

        return types.void(data, at), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


def _store(address: int, value: Any) -> None:
    """Write a number to an address, which must be that of such a number in an array that is kept meanwhile.

    A kernel takes a fixed number of arrays, and columns are as many as are asked for.
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
