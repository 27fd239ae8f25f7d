// The error function of float64 lanes, as `exponentials.h`, whose functions it uses.

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
