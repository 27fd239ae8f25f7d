"""SIMD vectors in C++ for Warp's native functions: a variable holds one value (lane) for each ray of a packet.

CPUs compute the lanes with vector instructions; GPUs use one lane, plain floats, and the same source. The types are V
(floats), D (doubles), I (integers) and C (conditions: joined by &, | and !, selecting in `c ? x : y`). Arrays of floats
hold one row of lanes a variable; `load` and `store` take the row's number.
"""

import warp as wp

CPU_WIDTH = 16
# Fused multiply-add.
OPTIONS = {"cpu_compiler_flags": f"{wp.config.cpu_compiler_flags} -ffp-contract=fast"}


def group_of(width: int) -> int:
    """Samples that one item of a launch traces: a tile of 64 on CPUs, as each item has a cost; one on GPUs."""
    return 64 if width > 1 else 1


_ONE = """
typedef float V; typedef double D; typedef int I; typedef bool C;
auto wide = [](V x) { return (D)x; };
auto narrow = [](D x) { return (V)x; };
auto any = [](C c) { return c; };
auto top = [](V x) { return x; };
auto size = [](V x) { return fabsf(x); };
auto root = [](V x) { return sqrtf(x > 0.0f ? x : 0.0f); };
auto exact_root = [](D x) { return sqrt(x); };
auto bits = [](V x) { I i; memcpy(&i, &x, sizeof(i)); return i; };
auto from_bits = [](I i) { V x; memcpy(&x, &i, sizeof(x)); return x; };
auto real = [](I i) { return (V)i; };
auto whole = [](V x) { return (I)x; };
"""
_MANY = """
typedef float V __attribute__((ext_vector_type(WIDTH), aligned(4)));
typedef double D __attribute__((ext_vector_type(WIDTH), aligned(8)));
typedef int I __attribute__((ext_vector_type(WIDTH), aligned(4)));
typedef I C;
auto wide = [](V x) { return __builtin_convertvector(x, D); };
auto narrow = [](D x) { return __builtin_convertvector(x, V); };
auto any = [](C c) { return __builtin_reduce_or(c) != 0; };
auto top = [](V x) { return __builtin_reduce_max(x); };
auto size = [](V x) { return __builtin_elementwise_abs(x); };
auto root = [](V x) { return __builtin_elementwise_sqrt(x > 0.0f ? x : (V)0.0f); };
auto exact_root = [](D x) { return __builtin_elementwise_sqrt(x); };
auto bits = [](V x) { return *(I*)&x; };
auto from_bits = [](I i) { return *(V*)&i; };
auto real = [](I i) { return __builtin_convertvector(i, V); };
auto whole = [](V x) { return __builtin_convertvector(x, I); };
"""
# exp and log to 2e-7 without a call (Cody and Waite; Cephes), erfc to 1.2e-7 of itself (Numerical Recipes).
_MATHS = """
auto least = [](V x, V y) { return x < y ? x : y; };
auto most = [](V x, V y) { return x > y ? x : y; };
auto load = [](const float* rows, int k) { return *(const V*)(rows + k * WIDTH); };
auto store = [](float* rows, int k, V x) { *(V*)(rows + k * WIDTH) = x; };
auto exp = [&](V x) {
    V y = least(most(x * 1.44269504f, (V)-126.0f), (V)126.0f);
    V n = (y + 12582912.0f) - 12582912.0f;
    V f = y - n;
    return from_bits((whole(n) + 127) << 23) * (1.0f + f * (0.693147181f + f * (0.240226507f + f * (0.0555041087f
        + f * (0.00961812911f + f * (0.00133335581f + f * 0.000154035304f))))));
};
auto log = [&](V x) {
    I i = bits(x);
    I e = (i - 0x3f3504f3) >> 23;
    V m = from_bits(i - (e << 23)) - 1.0f;
    V p = ((((((((7.0376836292e-2f * m - 1.1514610310e-1f) * m + 1.1676998740e-1f) * m - 1.2420140846e-1f) * m
        + 1.4249322787e-1f) * m - 1.6668057665e-1f) * m + 2.0000714765e-1f) * m - 2.4999993993e-1f) * m
        + 3.3333331174e-1f);
    return (m + m * m * (m * p - 0.5f)) + real(e) * 0.693147181f;
};
auto erfc = [&](V x) {
    V z = size(x);
    V t = 1.0f / (1.0f + 0.5f * z);
    V r = t * exp(-z * z - 1.26551223f + t * (1.00002368f + t * (0.37409196f + t * (0.09678418f + t * (-0.18628806f
        + t * (0.27886807f + t * (-1.13520398f + t * (1.48851587f + t * (-0.82215223f + t * 0.17087277f)))))))));
    return x < 0.0f ? 2.0f - r : r;
};
"""


def cpp(width: int, body: str, **constants) -> str:
    """The C++ of a native function; constants: Python's numbers and booleans by their names there."""
    names = "".join(f"constexpr {_declared(name, value)};\n" for name, value in {"WIDTH": width, **constants}.items())
    return names + (_ONE if width == 1 else _MANY) + _MATHS + body


def _declared(name, value):
    if isinstance(value, bool):
        return f"bool {name} = {str(value).lower()}"
    return f"int {name} = {value}" if isinstance(value, int) else f"float {name} = {value!r}f"
