// Exponentials, logarithms, powers and hyperbolic functions of float64 lanes without calls or tables, to 2 ulp
// (tests/portable measures each). A lane takes the same steps whatever the others hold. Methods and coefficients, where
// nothing else is said: fdlibm (Sun Microsystems 1993; freely granted, as this notice is preserved). Polynomials of exp,
// sinh and tanh: Remez exchange in 60-digit arithmetic.

static Int bits(Real x) { return __builtin_bit_cast(Int, x); }

static Real from_bits(Int i) { return __builtin_bit_cast(Real, i); }

// The upper half of a number's digits.
static Real upper(Real x) { return from_bits(bits(x) & (long long)0xffffffff00000000ull); }

// p 2^k, also where it underflows (rounded once) or overflows.
static Real scaled(Real p, Int k)
{
    const Int half = k >> 1;
    return p * from_bits((half + 1023) << 52) * from_bits((k - half + 1023) << 52);
}

// exp(r) - 1 - r over r^2 for |r| <= log(2) / 2; fit: 1e-17 of exp.
static Real exp_rest(Real r)
{
    const Real r2 = r * r, r4 = r2 * r2;
    const Real low = (0.5000000000000001 + r * 0.16666666666666674) + r2 * (0.04166666666662398 + r * 0.008333333333322172);
    const Real high = (0.0013888888917285545 + r * 0.00019841269886699926)
        + r2 * (2.4801521185224727e-05 + r * 2.755724221351069e-06)
        + r4 * (2.7620140796145187e-07 + r * 2.511009630403349e-08);
    return low + r4 * high;
}

// exp(x) 2^shift.
static Real exp_shifted(Real x, int shift)
{
    x = x > 712.0 ? Real(712.0) : (x < -800.0 ? Real(-800.0) : x);
    const Real t = x * 1.4426950408889634 + 6755399441055744.0;
    const Real n = t - 6755399441055744.0;
    const Real r = (x - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10;
    return scaled(1.0 + (r + r * r * exp_rest(r)), (bits(t) - 0x4338000000000000ll) + shift);
}

static Real exp(Real x) { return exp_shifted(x, 0); }

// exp(high + low) / divisor, for -800 <= high <= 0 and |low| <= 2: low keeps all its digits.
static Real exp_over(Real high, Real low, Real divisor)
{
    const Real t = (high + low) * 1.4426950408889634 + 6755399441055744.0;
    const Real n = t - 6755399441055744.0;
    const Real a = high - n * 6.93147180369123816490e-01, b = low - n * 1.90821492927058770002e-10;
    const Real r = a + b, part = r - a, tail = (a - (r - part)) + (b - part);
    return scaled((1.0 + (r + (tail + r * r * exp_rest(r)))) / divisor, bits(t) - 0x4338000000000000ll);
}

// x = 2^k (1 + f) with 1 + f in sqrt(1/2)..sqrt(2), for x > 0; returns k.
static Real log_parts(Real x, Real& f)
{
    const Mask tiny = x < 2.2250738585072014e-308;
    const Int i = bits(tiny ? x * 18014398509481984.0 : x);
    const Int k = (i - 0x3fe6a09e667f3bcdll) >> 52;
    f = from_bits(i - (k << 52)) - 1.0;
    return to_real(k) - (tiny ? Real(54.0) : Real(0.0));
}

// log(1 + f) - f + f^2 / 2.
static Real log_rest(Real f)
{
    const Real s = f / (2.0 + f), z = s * s, w = z * z;
    const Real t1 = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
    const Real t2 = z * (6.666666666666735130e-01
        + w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
    return s * (0.5 * f * f + (t1 + t2));
}

// What a logarithm is where its argument is not finite and positive.
static Real log_checked(Real x, Real log)
{
    const Real odd = x == 0.0 ? Real(-__builtin_inf()) : Real(__builtin_nan(""));
    return x > 0.0 ? (x < __builtin_inf() ? log : x) : odd;
}

static Real log(Real x)
{
    Real f;
    const Real k = log_parts(x, f);
    const Real rest = log_rest(f) + k * 1.90821492927058770002e-10;
    return log_checked(x, k * 6.93147180369123816490e-01 - ((0.5 * f * f - rest) - f));
}

static Real log2(Real x)
{
    Real f;
    const Real k = log_parts(x, f), half = 0.5 * f * f;
    const Real high = upper(f - half), low = ((f - high) - half) + log_rest(f);
    const Real product = high * 1.44269504072144627571e+00;
    const Real rest = (low + high) * 1.67517131648865118353e-10 + low * 1.44269504072144627571e+00;
    const Real sum = k + product;
    return log_checked(x, (rest + ((k - sum) + product)) + sum);
}

static Real log10(Real x)
{
    Real f;
    const Real k = log_parts(x, f), half = 0.5 * f * f;
    const Real high = upper(f - half), low = ((f - high) - half) + log_rest(f);
    const Real product = high * 4.34294481878168880939e-01, whole = k * 3.01029995663611771306e-01;
    const Real rest = k * 3.69423907715893078616e-13
        + ((low + high) * 2.50829467116452752298e-11 + low * 4.34294481878168880939e-01);
    const Real sum = whole + product;
    return log_checked(x, (rest + ((whole - sum) + product)) + sum);
}

static Real sinh(Real x)
{
    const Real a = abs(x), h = exp_shifted(a, -1), z = x * x;
    const Real p = 0.16666666666666666 + z * (0.008333333333333333 + z * (0.00019841269841269773 + z * (2.7557319224040365e-06
        + z * (2.5052108364049933e-08 + z * (1.6059048397539596e-10 + z * (7.646625275177843e-13
        + z * 2.8445288878999362e-15))))));
    return a < 1.0 ? x + x * (z * p) : copysign(h - 0.25 / h, x);
}

static Real cosh(Real x)
{
    const Real h = exp_shifted(abs(x), -1);
    return h + 0.25 / h;
}

static Real tanh(Real x)
{
    const Real a = abs(x), z = a < 0.6 ? x * x : Real(0.0);
    const Real p = -0.3333333333333333 + z * (0.13333333333333214 + z * (-0.05396825396809302 + z * (0.02186948852770115
        + z * (-0.008863235300177418 + z * (0.0035921243453000797 + z * (-0.0014557966535024337
        + z * (0.0005897720748726862 + z * (-0.00023796523694479603 + z * (9.33516383374747e-05
        + z * (-3.211850794739168e-05 + z * 6.950129574709391e-06))))))))));
    return copysign(a < 0.6 ? a + a * (z * p) : 1.0 - 2.0 / (exp(2.0 * a) + 1.0), x);
}

// log2(x) of finite x > 0 as a sum, whose first part has half the digits.
static Real log2_pair(Real x, Real& low)
{
    const Mask tiny = x < 2.2250738585072014e-308;
    const Int i = bits(tiny ? x * 18014398509481984.0 : x);
    Int k = (i >> 52) - 1023;
    Real m = from_bits((i & 0xfffffffffffffll) | 0x3ff0000000000000ll);
    const Mask above = m >= 1.7320508075688772, middle = (m >= 1.2247448713915890) & ~above;
    k = above ? k + 1 : k;
    m = above ? 0.5 * m : m;
    const Real n = to_real(k) - (tiny ? Real(54.0) : Real(0.0)), base = middle ? Real(1.5) : Real(1.0);
    const Real u = m - base, v = 1.0 / (m + base), ss = u * v, s_h = upper(ss), t_h = upper(m + base);
    const Real s_l = v * ((u - s_h * t_h) - s_h * (m - (t_h - base)));
    const Real z = ss * ss;
    const Real r = z * z * (5.99999999999994648725e-01 + z * (4.28571428578550184252e-01 + z * (3.33333329818377432918e-01
        + z * (2.72728123808534006489e-01 + z * (2.30660745775561754067e-01 + z * 2.06975017800338417784e-01)))))
        + s_l * (s_h + ss);
    const Real s2 = s_h * s_h, h = upper(3.0 + s2 + r), l = r - ((h - 3.0) - s2);
    const Real first = s_h * h, second = s_l * h + l * ss;
    const Real p_h = upper(first + second), p_l = second - (p_h - first);
    const Real z_h = 9.61796700954437255859e-01 * p_h;
    const Real z_l = -7.02846165095275826516e-09 * p_h + p_l * 9.61796693925975554329e-01
        + (middle ? Real(1.35003920212974897128e-08) : Real(0.0));
    const Real offset = middle ? Real(5.84962487220764160156e-01) : Real(0.0);
    const Real high = upper(((z_h + z_l) + offset) + n);
    low = z_l - (((high - n) - offset) - z_h);
    return high;
}

static Real pow(Real x, Real y)
{
    const Real a = abs(x), b = y > 3.7e19 ? Real(3.7e19) : (y < -3.7e19 ? Real(-3.7e19) : y);
    Real low;
    const Real high = log2_pair(a, low), head = upper(b);
    Real p_h = head * high, p_l = (b - head) * high + b * low;
    const Real sum = p_l + p_h;
    p_l = sum > 1100.0 ? Real(0.0) : (sum < -1200.0 ? Real(0.0) : p_l);
    p_h = sum > 1100.0 ? Real(1100.0) : (sum < -1200.0 ? Real(-1200.0) : p_h);
    const Real t = (p_l + p_h) + 6755399441055744.0;
    p_h -= t - 6755399441055744.0;
    const Real w = upper(p_l + p_h), u = w * 6.93147182464599609375e-01;
    const Real v = (p_l - (w - p_h)) * 6.93147180559945286227e-01 + w * -1.90465429995776804525e-09;
    const Real r = u + v, tail = v - (r - u);
    Real result = scaled(1.0 + (r + (tail + r * r * exp_rest(r))), bits(t) - 0x4338000000000000ll);
    // Ends: zeros and infinities, then signs, then what is no number.
    const Mask up = y > 0.0, whole = y == floor(y), odd = whole & (floor(0.5 * y) != 0.5 * y);
    const Real infinite = Real(__builtin_inf()), zero = Real(0.0);
    result = a == 0.0 ? (up ? zero : infinite) : result;
    result = a == infinite ? (up ? infinite : zero) : result;
    result = abs(y) == infinite ? (a == 1.0 ? Real(1.0) : ((a > 1.0) ^ up ? zero : infinite)) : result;
    result = (x < 0.0) & ~whole & (a < infinite) ? Real(__builtin_nan("")) : result;
    result = (bits(x) < 0) & odd ? -result : result;
    result = (x != x) | (y != y) ? x + y : result;
    return (y == 0.0) | (x == 1.0) ? Real(1.0) : result;
}
