"""Processor instructions for kernels that numba does not provide.

`prefetch`, `store`, `copy_block`, `load`, two on bits, three on rows of numbers, `part_of` an array, and
`widest_vectors`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.kernels import Kernel

# `add_products`, `add_rows` and `set_rows` handle so many numbers at once: a row.
LANES = 16


def aligned_zeros(count: int) -> npt.NDArray[np.float64]:
    """Return zeros (count,) that begin with a cache line of the processor, so that a row is in as few as possible."""
    line = 64
    spare = np.zeros(count + line // 8)
    begin = -spare.ctypes.data % line // 8
    return spare[begin : begin + count]


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


def _add_products(sums: Any, at: Any, first: Any, first_at: Any, second: Any, second_at: Any, count: Any) -> None:
    """Add products to a row of the array `sums` from index `at` on: those of rows of `first` and `second`, one by one.

    `count` rows of both, one after the other, begin at `first_at` and `second_at`. All must be in the arrays, of
    float64. A loop over few numbers takes longer to find that arrays do not overlap than to compute.
    """


def _add_rows(sums: Any, at: Any, rows: Any, first: Any, factors: Any, factors_at: Any, count: Any) -> None:
    """Add `count` rows of `rows`, which begin at index `first`, each multiplied by the same row of `factors`.

    They are added to the rows of `sums` that begin at `at`. All must be in the arrays, of float64.
    """


def _set_rows(results: Any, at: Any, rows: Any, first: Any, factors: Any, factors_at: Any, count: Any) -> None:
    """As `add_rows`, but the products replace what was in `results`, which may be `rows` itself."""


def _emit_on_rows(lines_of: Callable[..., None]) -> Callable[..., Any]:
    """Return an instruction on rows of three arrays, each with an index, and a count of rows.

    `lines_of(builder, count, row_of)` writes it; `row_of(which, number)` is the address of a row of an array.
    """
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    vector = ir.VectorType(ir.DoubleType(), LANES)

    def emit(_: Any, first: Any, first_at: Any, second: Any, second_at: Any, third: Any, third_at: Any, n: Any) -> Any:
        def lines(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            def row_of(which: int, number: Any = None) -> Any:
                array = context.make_array(signature.args[2 * which])(context, builder, arguments[2 * which])
                at = arguments[2 * which + 1]
                if number is not None:
                    at = builder.add(at, builder.mul(number, ir.Constant(number.type, LANES)))
                return builder.bitcast(builder.gep(array.data, [at]), vector.as_pointer())

            lines_of(builder, arguments[6], row_of)
            return context.get_dummy_value()

        return types.void(first, first_at, second, second_at, third, third_at, n), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


def _emit_add_products() -> Callable[..., Any]:
    from numba.core import cgutils

    build: Any = cgutils

    def lines(builder: Any, count: Any, row_of: Any) -> None:
        kept = build.alloca_once_value(builder, builder.load(row_of(0), align=8))
        with build.for_range(builder, count) as loop:
            one, other = (builder.load(row_of(which, loop.index), align=8) for which in (1, 2))
            product = builder.fmul(one, other, flags=("contract",))
            builder.store(builder.fadd(builder.load(kept), product, flags=("contract",)), kept)
        builder.store(builder.load(kept), row_of(0), align=8)

    return _emit_on_rows(lines)


def _emit_rows(adds: bool) -> Callable[..., Any]:
    from numba.core import cgutils

    build: Any = cgutils

    def lines(builder: Any, count: Any, row_of: Any) -> None:
        factors = builder.load(row_of(2), align=8)
        with build.for_range(builder, count) as loop:
            result = builder.fmul(builder.load(row_of(1, loop.index), align=8), factors, flags=("contract",))
            place = row_of(0, loop.index)
            if adds:
                result = builder.fadd(builder.load(place, align=8), result, flags=("contract",))
            builder.store(result, place, align=8)

    return _emit_on_rows(lines)


def _part_of(data: Any, at: Any, size: Any) -> Any:
    """Return `size` elements of the contiguous array `data` from element `at` on, in the order of the memory (size,).

    All must be in the array, which must live longer than its part. A slice takes longer: its limits are compared with
    the length, and its array is counted as in use, by an instruction that locks the memory.
    """


def _emit_part_of() -> Callable[..., Any]:
    from numba import types
    from numba.extending import intrinsic
    from numba.np import arrayobj

    populate: Any = arrayobj.populate_array

    def emit(_: Any, data: Any, at: Any, size: Any) -> Any:  # noqa: ARG001 - numba requires the instruction's own
        def lines(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            whole = context.make_array(signature.args[0])(context, builder, arguments[0])
            part = context.make_array(signature.return_type)(context, builder)
            place, width = builder.gep(whole.data, [arguments[1]]), context.get_constant(types.intp, 8)
            populate(part, data=place, shape=[arguments[2]], strides=[width], itemsize=width, meminfo=None)
            return part._getvalue()

        return types.Array(data.dtype, 1, "C", readonly=not data.mutable)(data, types.intp, types.intp), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


def _widest_vectors() -> None:
    """Let the loops of the kernel that contains it use the widest vectors of the processor.

    The compiler uses half of a width of 512 bits by default, because the first processors that had it slowed down. The
    numbers have the same bits.
    """


def _emit_widest_vectors() -> Callable[..., Any]:
    from numba import types
    from numba.extending import intrinsic

    def emit(_: Any) -> Any:
        def lines(context: Any, builder: Any, _: Any, __: Any) -> Any:
            # llvmlite's own `add` accepts only attributes without a value.
            set.add(builder.function.attributes, '"prefer-vector-width"="512"')
            return context.get_dummy_value()

        return types.void(), lines

    made: Callable[..., Any] = intrinsic(emit)
    return made


prefetch = _Instruction(_prefetch, _emit_prefetch)
store = _Instruction(_store, _emit_store)
copy_block = _Instruction(_copy_block, _emit_copy_block)
load = _Instruction(_load, _emit_load)
equal_bytes = _Instruction(_equal_bytes, _emit_equal_bytes)
trailing_zeros = _Instruction(_trailing_zeros, _emit_trailing_zeros)
add_products = _Instruction(_add_products, _emit_add_products)
add_rows = _Instruction(_add_rows, partial(_emit_rows, True))
set_rows = _Instruction(_set_rows, partial(_emit_rows, False))
part_of = _Instruction(_part_of, _emit_part_of)
widest_vectors = _Instruction(_widest_vectors, _emit_widest_vectors)
