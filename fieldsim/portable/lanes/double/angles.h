// Circular functions of float64 lanes and their inverses, as `exponentials.h`; the polynomial of atan: Remez exchange.

// x less the nearest multiple of pi / 2, as a sum, for |x| <= 1e5; returns its number, of which the last bits count.
static Int quarters(Real x, Real& high, Real& low)
{
    const Real t = x * 6.36619772367581382433e-01 + 6755399441055744.0;
    const Real n = t - 6755399441055744.0;
    const Real r = x - n * 1.57079632673412561417e+00, w = n * 6.07710050630396597660e-11;
    const Real h = r - w, e = ((r - h) - w) - n * 2.02226624879595063154e-21;
    high = h + e;
    low = (h - high) + e;
    return bits(t);
}

static Mask beyond_quarters(Real x) { return abs(x) > 1e5; }

// Sine and cosine of high + low within pi / 4.
static Real sine_within(Real x, Real y)
{
    const Real z = x * x, v = z * x;
    const Real r = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06)
        + z * (z * z) * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10);
    return x - ((z * (0.5 * y - v * r) - y) - v * -1.66666666666666324348e-01);
}

static Real cosine_within(Real x, Real y)
{
    const Real z = x * x, w = z * z;
    const Real r = z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05))
        + w * w * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
    const Real half = 0.5 * z, rest = 1.0 - half;
    return rest + (((1.0 - rest) - half) + (z * r - x * y));
}

static Real sin(Real x)
{
    Real high, low;
    const Int k = quarters(x, high, low);
    const Real r = (k & 1) != 0 ? cosine_within(high, low) : sine_within(high, low);
    Real result = abs(x) < 7.450580596923828e-09 ? x : ((k & 2) != 0 ? -r : r);
    if (any(beyond_quarters(x)))
        for (int lane = 0; lane < WIDTH; ++lane)
            if (__builtin_fabs(x[lane]) > 1e5) result[lane] = ::sin(x[lane]);
    return result;
}

static Real cos(Real x)
{
    Real high, low;
    const Int k = quarters(x, high, low);
    const Real r = (k & 1) != 0 ? sine_within(high, low) : cosine_within(high, low);
    Real result = ((k + 1) & 2) != 0 ? -r : r;
    if (any(beyond_quarters(x)))
        for (int lane = 0; lane < WIDTH; ++lane)
            if (__builtin_fabs(x[lane]) > 1e5) result[lane] = ::cos(x[lane]);
    return result;
}

// tan(x + y) within pi / 4, or -1 / tan where `turned`.
static Real tangent_within(Real x, Real y, Mask turned)
{
    const Mask wide = abs(x) >= 0.67434, below = wide & (x < 0.0);
    const Real a = 7.85398163397448278999e-01 - (below ? -x : x), b = 3.06161699786838301793e-17 - (below ? -y : y);
    x = wide ? a + b : x;
    y = wide ? Real(0.0) : y;
    const Real z = x * x, w = z * z, s = z * x;
    const Real odd = 1.33333333333201242699e-01 + w * (2.18694882948595424599e-02 + w * (3.59207910759131235356e-03
        + w * (5.88041240820264096874e-04 + w * (7.81794442939557092300e-05 + w * -1.85586374855275456654e-05))));
    const Real even = z * (5.39682539762260521377e-02 + w * (8.86323982359930005737e-03 + w * (1.45620945432529025516e-03
        + w * (2.46463134818469906812e-04 + w * (7.14072491382608190305e-05 + w * 2.59073051863633712884e-05)))));
    const Real r = (y + z * (s * (odd + even) + y)) + 3.33333333333334091986e-01 * s;
    const Real t = x + r;
    const Real sign = turned ? Real(-1.0) : Real(1.0);
    const Real folded = sign - 2.0 * (x - (t * t / (t + sign) - r));
    // -1 / (x + r) with the quotient's error put right.
    const Real quotient = -1.0 / t, head = upper(quotient), part = upper(t), rest = r - (part - x);
    const Real inverse = head + quotient * ((1.0 + head * part) + head * rest);
    return wide ? (below ? -folded : folded) : (turned ? inverse : t);
}

static Real tan(Real x)
{
    Real high, low;
    const Int k = quarters(x, high, low);
    const Real r = tangent_within(high, low, (k & 1) != 0);
    Real result = abs(x) < 7.450580596923828e-09 ? x : r;
    if (any(beyond_quarters(x)))
        for (int lane = 0; lane < WIDTH; ++lane)
            if (__builtin_fabs(x[lane]) > 1e5) result[lane] = ::tan(x[lane]);
    return result;
}

// The angle of (along, across), 0 <= across <= along: a quotient turned back to at most tan(pi / 8). Fit: 2e-18.
static Real angle(Real across, Real along)
{
    const Mask folded = across > along * 0.41421356237309503;
    const Real t = (folded ? across - along : across) / (folded ? across + along : along);
    const Real u = t * t, u2 = u * u, u4 = u2 * u2;
    const Real low = (-0.3333333333333333 + u * 0.19999999999995777) + u2 * (-0.142857142847154 + u * 0.11111111018877935);
    const Real middle = (-0.09090904714548766 + u * 0.07692186144305987)
        + u2 * (-0.06664550390626829 + u * 0.05858466833345495);
    const Real high = -0.05087018626704218 + u * 0.03927453300368874 + u2 * -0.019226694540414386;
    const Real rest = t * u * (low + u4 * (middle + u4 * high));
    return folded ? 0.7853981633974483 + (t + (rest + 3.061616997868383e-17)) : t + rest;
}

static Real atan(Real x)
{
    const Real a = abs(x);
    const Mask far_ = a > 1.0;
    const Real r = angle(far_ ? Real(1.0) : a, far_ ? a : Real(1.0));
    return copysign(far_ ? 1.5707963267948966 - (r - 6.123233995736766e-17) : r, x);
}

static Real atan2(Real y, Real x)
{
    Real a = abs(x), b = abs(y);
    const Mask ends = (a == __builtin_inf()) & (b == __builtin_inf());
    const Real scale = (a > 1e300) | (b > 1e300) ? Real(0.0625) : Real(1.0);
    a = ends ? Real(1.0) : a * scale;
    b = ends ? Real(1.0) : b * scale;
    const Mask steep = b > a;
    const Real along = steep ? b : a;
    Real r = angle(steep ? a : b, along == 0.0 ? Real(1.0) : along);
    r = steep ? 1.5707963267948966 - (r - 6.123233995736766e-17) : r;
    r = bits(x) < 0 ? 3.141592653589793 - (r - 1.2246467991473532e-16) : r;
    return copysign((x != x) | (y != y) ? x + y : r, y);
}

// (asin(sqrt(t)) / sqrt(t) - 1) for t in 0..1/4.
static Real arcsine_rest(Real t)
{
    const Real p = t * (1.66666666666666657415e-01 + t * (-3.25565818622400915405e-01 + t * (2.01212532134862925881e-01
        + t * (-4.00555345006794114027e-02 + t * (7.91534994289814532176e-04 + t * 3.47933107596021167570e-05)))));
    return p / (1.0 + t * (-2.40339491173441421878e+00 + t * (2.02094576023350569471e+00
        + t * (-6.88283971605453293030e-01 + t * 7.70381505559019352791e-02))));
}

static Real asin(Real x)
{
    const Real a = abs(x);
    const Mask outer = a >= 0.5;
    const Real t = outer ? 0.5 * (1.0 - a) : a * a, r = arcsine_rest(t), s = sqrt(t), head = upper(s);
    const Real rest = s == 0.0 ? Real(0.0) : (t - head * head) / (s + head);
    const Real p = 2.0 * s * r - (6.12323399573676603587e-17 - 2.0 * rest), q = 7.85398163397448278999e-01 - 2.0 * head;
    return outer ? copysign(7.85398163397448278999e-01 - (p - q), x) : x + x * r;
}

static Real acos(Real x)
{
    const Real a = abs(x);
    const Mask outer = a >= 0.5;
    const Real t = outer ? 0.5 * (1.0 - a) : a * a, r = arcsine_rest(t), s = sqrt(t), head = upper(s);
    const Real rest = s == 0.0 ? Real(0.0) : (t - head * head) / (s + head);
    const Real near_one = 2.0 * (head + (r * s + rest));
    const Real near_less = 3.14159265358979311600e+00 - 2.0 * (s + (r * s - 6.12323399573676603587e-17));
    const Real within = 1.57079632679489655800e+00 - (x - (6.12323399573676603587e-17 - x * r));
    return outer ? (x < 0.0 ? near_less : near_one) : within;
}
