"""Processor instructions for kernels that numba does not provide.

`prefetch`, `store`, `copy_block`, `load`, and two on bits.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cached_property
from typing import Any

from cdtool.kernels import Kernel


class _Instruction(Kernel):
    """Used in kernels like another kernel; there is nothing to compile, and numba is loaded only on use."""

    def __init__(self, function: Callable[..., Any], made: Callable[[], Callable[..., Any]]) -> None:
        super().__init__(function, "", False)
        self._made = made

    @cached_property
    def part(self) -> Any:
        """Return the numba function for use in a kernel."""
        return self._made()


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


def _copy_block(address: int, data: Any, at: Any) -> None:
    """Copy the 32 bytes from byte `at` of the array `data` to an address, as `store` does; they must not overlap."""


def _emit_copy_block() -> Callable[..., Any]:
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    def emit(_: Any, address: Any, data: Any, at: Any) -> Any:
        def lines(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = context.make_array(signature.args[1])(context, builder, arguments[1])
            vector = ir.VectorType(ir.IntType(8), 32).as_pointer()
            place = builder.gep(builder.bitcast(array.data, ir.IntType(8).as_pointer()), [arguments[2]])
            block = builder.load(builder.bitcast(place, vector), align=1)
            builder.store(block, builder.inttoptr(arguments[0], vector), align=1)
            return context.get_dummy_value()

        return types.void(address, data, at), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


def _load(data: Any, at: Any) -> Any:
    """Return the eight bytes from byte `at` of the array `data` as a uint64, the first one in the lowest bits.

    All eight must be in the array. A kernel that reads eight bytes of text at once needs few unpredictable jumps.
    """


def _emit_load() -> Callable[..., Any]:
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    def emit(_: Any, data: Any, at: Any) -> Any:
        def lines(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = context.make_array(signature.args[0])(context, builder, arguments[0])
            place = builder.gep(builder.bitcast(array.data, ir.IntType(8).as_pointer()), [arguments[1]])
            word = builder.load(builder.bitcast(place, ir.IntType(64).as_pointer()), align=1)
            return word if sys.byteorder == "little" else builder.bswap(word)

        return types.uint64(data, at), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


def _equal_bytes(data: Any, at: Any, letter: Any) -> Any:
    """Return a uint64 with a bit for each of the 64 bytes from byte `at` of the array `data` that is equal to `letter`.

    All 64 must be in the array; the lowest bit is that of the first one.
    """


def _emit_equal_bytes() -> Callable[..., Any]:
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    def emit(_: Any, data: Any, at: Any, letter: Any) -> Any:
        def lines(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = context.make_array(signature.args[0])(context, builder, arguments[0])
            byte, bits = ir.IntType(8), ir.IntType(64)
            vector = ir.VectorType(byte, 64)
            place = builder.gep(builder.bitcast(array.data, byte.as_pointer()), [arguments[1]])
            letters = builder.load(builder.bitcast(place, vector.as_pointer()), align=1)
            first = ir.Constant(ir.IntType(32), 0)
            one = builder.insert_element(ir.Constant(vector, ir.Undefined), builder.trunc(arguments[2], byte), first)
            every = builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(ir.IntType(32), 64), [first] * 64))
            equal = builder.bitcast(builder.icmp_unsigned("==", letters, every), bits)
            return equal if sys.byteorder == "little" else builder.bitreverse(equal)

        return types.uint64(data, at, letter), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


def _trailing_zeros(word: Any) -> Any:
    """Return how many of the lowest bits of a uint64 are 0; 64 if all are."""


def _emit_trailing_zeros() -> Callable[..., Any]:
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    def emit(_: Any, word: Any) -> Any:  # noqa: ARG001 - numba requires the instruction's own parameters
        def lines(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
            return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 0))

        return types.uint64(types.uint64), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


prefetch = _Instruction(_prefetch, _emit_prefetch)
store = _Instruction(_store, _emit_store)
copy_block = _Instruction(_copy_block, _emit_copy_block)
load = _Instruction(_load, _emit_load)
equal_bytes = _Instruction(_equal_bytes, _emit_equal_bytes)
trailing_zeros = _Instruction(_trailing_zeros, _emit_trailing_zeros)
