// Elementary functions of float32 lanes, as those of `double/`. What is not here goes by way of float64.

static Int bits(Real x) { return __builtin_bit_cast(Int, x); }

static Real from_bits(Int i) { return __builtin_bit_cast(Real, i); }

static Wide widen(Real x) { return __builtin_convertvector(x, Wide); }

static Real narrow(Wide x) { return __builtin_convertvector(x, Real); }

// Fit: 8e-9 of exp.
static Real exp(Real x)
{
    x = x > 90.0f ? Real(90.0f) : (x < -120.0f ? Real(-120.0f) : x);
    const Real t = x * 1.44269504f + 12582912.0f, n = t - 12582912.0f;
    const Real r = (x - n * 0.693359375f) - n * -2.12194440e-4f, r2 = r * r;
    const Real p = (0.5f + r * 0.16666576f) + r2 * (0.041666374f + r * 0.008363208f + r2 * 0.0013941163f);
    const Int k = bits(t) - 0x4b400000, half = k >> 1;
    return (1.0f + (r + r2 * p)) * from_bits((half + 127) << 23) * from_bits((k - half + 127) << 23);
}

static Real log(Real x)
{
    const Mask tiny = x < 1.17549435e-38f;
    const Int i = bits(tiny ? x * 33554432.0f : x);
    const Int e = (i - 0x3f3504f3) >> 23;
    const Real f = from_bits(i - (e << 23)) - 1.0f, k = to_real(e) - (tiny ? Real(25.0f) : Real(0.0f));
    const Real s = f / (2.0f + f), z = s * s, w = z * z, half = 0.5f * f * f;
    const Real r = z * (0.66666662693f + w * 0.28498786688f) + w * (0.40000972152f + w * 0.24279078841f);
    const Real whole = k * 6.9313812256e-01f - ((half - (s * (half + r) + k * 9.0580006145e-06f)) - f);
    const Real odd = x == 0.0f ? Real(-__builtin_inff()) : Real(__builtin_nanf(""));
    return x > 0.0f ? (x < __builtin_inff() ? whole : x) : odd;
}

// x less the nearest multiple of pi / 2, for |x| <= 1e5; returns its number, of which the last bits count.
static Int quarters(Real x, Real& rest)
{
    const Wide w = widen(x), t = w * 6.36619772367581382433e-01 + 6755399441055744.0, n = t - 6755399441055744.0;
    rest = narrow((w - n * 1.57079632673412561417e+00) - n * 6.07710050650619224932e-11);
    return __builtin_convertvector(__builtin_bit_cast(WideInt, t), Int);
}

static Real sine_within(Real x)
{
    const Real z = x * x;
    return x + x * z * (-0.16666666641626524f + z * (0.0083333293858894632f + z * (-0.00019839334836096632f
        + z * 2.7183114939898219e-6f)));
}

static Real cosine_within(Real x)
{
    const Real z = x * x, half = 0.5f * z, rest = 1.0f - half;
    return rest + (((1.0f - rest) - half) + z * z * (0.041666645683f + z * (-0.0013887316255f + z * 2.4433157118e-5f)));
}

static Real sin(Real x)
{
    Real rest;
    const Int k = quarters(x, rest);
    const Real r = (k & 1) != 0 ? cosine_within(rest) : sine_within(rest);
    Real result = abs(x) < 1e-4f ? x : ((k & 2) != 0 ? -r : r);
    if (any(abs(x) > 1e5f))
        for (int lane = 0; lane < WIDTH; ++lane)
            if (__builtin_fabsf(x[lane]) > 1e5f) result[lane] = (float)::sin((double)x[lane]);
    return result;
}

static Real cos(Real x)
{
    Real rest;
    const Int k = quarters(x, rest);
    const Real r = (k & 1) != 0 ? sine_within(rest) : cosine_within(rest);
    Real result = ((k + 1) & 2) != 0 ? -r : r;
    if (any(abs(x) > 1e5f))
        for (int lane = 0; lane < WIDTH; ++lane)
            if (__builtin_fabsf(x[lane]) > 1e5f) result[lane] = (float)::cos((double)x[lane]);
    return result;
}

// The angle of (along, across), 0 <= across <= along. Fit: 3e-9.
static Real angle(Real across, Real along)
{
    const Mask folded = across > along * 0.41421356f;
    const Real t = (folded ? across - along : across) / (folded ? across + along : along);
    const Real u = t * t;
    const Real rest = t * u * (-0.3333333f + u * (0.19999559f + u * (-0.14264503f + u * (0.107488036f + u * -0.064666174f))));
    return folded ? 0.78539816f + (t + (rest - 2.1855694e-8f)) : t + rest;
}

static Real atan(Real x)
{
    const Real a = abs(x);
    const Mask far_ = a > 1.0f;
    const Real r = angle(far_ ? Real(1.0f) : a, far_ ? a : Real(1.0f));
    return copysign(far_ ? 1.5707964f - (r + 4.371139e-8f) : r, x);
}

static Real atan2(Real y, Real x)
{
    Real a = abs(x), b = abs(y);
    const Mask ends = (a == __builtin_inff()) & (b == __builtin_inff());
    const Real scale = (a > 1e37f) | (b > 1e37f) ? Real(0.0625f) : Real(1.0f);
    a = ends ? Real(1.0f) : a * scale;
    b = ends ? Real(1.0f) : b * scale;
    const Mask steep = b > a;
    const Real along = steep ? b : a;
    Real r = angle(steep ? a : b, along == 0.0f ? Real(1.0f) : along);
    r = steep ? 1.5707964f - (r + 4.371139e-8f) : r;
    r = bits(x) < 0 ? 3.1415927f - (r + 8.742278e-8f) : r;
    return copysign((x != x) | (y != y) ? x + y : r, y);
}
