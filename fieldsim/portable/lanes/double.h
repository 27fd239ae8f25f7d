// Elementary functions of float64 lanes without calls or tables, to 2 ulp (tests/portable measures each). A lane takes
// the same steps whatever the others hold. Methods and coefficients, where nothing else is said: fdlibm (Sun
// Microsystems 1993; freely granted, as this notice is preserved). Polynomials of exp, atan, sinh and tanh: Remez
// exchange in 60-digit arithmetic.

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

// erf(x) / x - 1 for |x| < 0.84375.
static Real erf_near(Real x)
{
    const Real z = x * x;
    const Real r = 1.28379167095512558561e-01 + z * (-3.25042107247001499370e-01 + z * (-2.84817495755985104766e-02
        + z * (-5.77027029648944159157e-03 + z * -2.37630166566501626084e-05)));
    return r / (1.0 + z * (3.97917223959155352819e-01 + z * (6.50222499887672944485e-02 + z * (5.08130628187576562776e-03
        + z * (1.32494738004321644526e-04 + z * -3.96022827877536812320e-06)))));
}

// erf(x) - 0.845... for x in 0.84375..1.25.
static Real erf_middle(Real x)
{
    const Real s = x - 1.0;
    const Real p = -2.36211856075265944077e-03 + s * (4.14856118683748331666e-01 + s * (-3.72207876035701323847e-01
        + s * (3.18346619901161753674e-01 + s * (-1.10894694282396677476e-01 + s * (3.54783043256182359371e-02
        + s * -2.16637559486879084300e-03)))));
    return p / (1.0 + s * (1.06420880400844228286e-01 + s * (5.40397917702171048937e-01 + s * (7.18286544141962662868e-02
        + s * (1.26171219808761642112e-01 + s * (1.36370839120290507362e-02 + s * 1.19844998467991074170e-02))))));
}

// erfc(x) for x >= 1.25. Called, not inlined: few lanes get here, and compilers take long over copies.
__attribute__((noinline)) static Real erfc_far(Real x)
{
    x = x > 28.0 ? Real(28.0) : x;
    const Real s = 1.0 / (x * x);
    const Mask less = x < 2.857142857142857;
    const Real r = (less ? Real(-9.86494403484714822705e-03) : Real(-9.86494292470009928597e-03))
        + s * ((less ? Real(-6.93858572707181764372e-01) : Real(-7.99283237680523006574e-01))
        + s * ((less ? Real(-1.05586262253232909814e+01) : Real(-1.77579549177547519889e+01))
        + s * ((less ? Real(-6.23753324503260060396e+01) : Real(-1.60636384855821916062e+02))
        + s * ((less ? Real(-1.62396669462573470355e+02) : Real(-6.37566443368389627722e+02))
        + s * ((less ? Real(-1.84605092906711035994e+02) : Real(-1.02509513161107724954e+03))
        + s * ((less ? Real(-8.12874355063065934246e+01) : Real(-4.83519191608651397019e+02))
        + s * (less ? Real(-9.81432934416914548592e+00) : Real(0.0))))))));
    const Real q = 1.0 + s * ((less ? Real(1.96512716674392571292e+01) : Real(3.03380607434824582924e+01))
        + s * ((less ? Real(1.37657754143519042600e+02) : Real(3.25792512996573918826e+02))
        + s * ((less ? Real(4.34565877475229228821e+02) : Real(1.53672958608443695994e+03))
        + s * ((less ? Real(6.45387271733267880336e+02) : Real(3.19985821950859553908e+03))
        + s * ((less ? Real(4.29008140027567833386e+02) : Real(2.55305040643316442583e+03))
        + s * ((less ? Real(1.08635005541779435134e+02) : Real(4.74528541206955367215e+02))
        + s * ((less ? Real(6.57024977031928170135e+00) : Real(-2.24409524465858183362e+01))
        + s * (less ? Real(-6.04244152148580987438e-02) : Real(0.0)))))))));
    const Real z = upper(x);
    return exp_over(-z * z - 0.5625, (z - x) * (z + x) + r / q, x);
}

static Real erf(Real x)
{
    const Real a = abs(x);
    Real r = x + x * erf_near(x);
    if (any(a >= 0.84375)) r = a >= 0.84375 ? copysign(8.45062911510467529297e-01 + erf_middle(a), x) : r;
    if (any(a >= 1.25)) r = a >= 1.25 ? copysign(1.0 - erfc_far(a), x) : r;
    return r;
}

static Real erfc(Real x)
{
    const Real a = abs(x), near_ = x * erf_near(x);
    Real r = x < 0.25 ? 1.0 - (x + near_) : 0.5 - (near_ + (x - 0.5));
    if (any(a >= 0.84375)) {
        const Real m = erf_middle(a);
        r = a >= 0.84375 ? (x < 0.0 ? 1.0 + (8.45062911510467529297e-01 + m) : 1.54937088489532470703e-01 - m) : r;
    }
    if (any(a >= 1.25)) {
        const Real f = erfc_far(a);
        r = a >= 1.25 ? (x < 0.0 ? 2.0 - f : f) : r;
    }
    return r;
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
