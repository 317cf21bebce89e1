"""The processor's prefetch instruction, for kernels that pick a few bytes here and there out of much memory.

Such a kernel waits for memory most of its time. Told some elements ahead which places come next, the processor fetches
them meanwhile: picking numbers out of messages takes less than half as long.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cdtool.kernels import Kernel


class _Instruction(Kernel):
    """Stands in kernels like another kernel; there is nothing to compile, and numba is loaded only where it is used."""

    @property
    def compiled(self) -> Callable[..., Any]:
        """What numba makes of it in a kernel."""
        if self._compiled is None:
            self._compiled = _intrinsic()
        return self._compiled


def _nothing(data: Any, at: int) -> None:
    """Fetch the cache line of byte `at` after the first one of the array `data`; it need not exist. Changes nothing."""


prefetch = _Instruction(_nothing, "")


def _intrinsic() -> Callable[..., Any]:
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
