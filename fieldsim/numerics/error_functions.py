"""The scaled complementary error function, portable: what Gaussian tails beyond a segment's end are made of."""

from fieldsim.portable import portable, real


@portable
def erfcx(x: real):
    """exp(x^2) erfc(x) for x >= 0. Relative error < 1e-15 (float32: 5e-7).

    (1 + 2x) erfcx(x) is smooth in t = (x - K) / (x + K), which maps [0, inf) to [-1, 1); its Chebyshev series there,
    written in powers of t. The map: Shepherd & Laframboise 1981; the coefficients: from 60-digit arithmetic.
    """
    t = (x - real(3.75)) / (x + real(3.75))
    p = real(-2.623107347133476e-09)
    p = p * t + real(-1.9551358868985616e-09)
    p = p * t + real(3.197926671666804e-08)
    p = p * t + real(1.879082322370048e-08)
    p = p * t + real(-2.4857126248016745e-07)
    p = p * t + real(-5.084465378687302e-08)
    p = p * t + real(1.7419821586224816e-06)
    p = p * t + real(-9.792625707303523e-07)
    p = p * t + real(-1.1438048033346894e-05)
    p = p * t + real(2.2387565714911816e-05)
    p = p * t + real(5.164652974177416e-05)
    p = p * t + real(-0.00029015535246077655)
    p = p * t + real(0.000293714378044958)
    p = p * t + real(0.0017556261651970652)
    p = p * t + real(-0.009746579683265262)
    p = p * t + real(0.02836227737211114)
    p = p * t + real(-0.05869339857664934)
    p = p * t + real(0.09230432116428125)
    p = p * t + real(-0.10880393014244462)
    p = p * t + real(0.08227673848999506)
    p = p * t + real(0.0035854154854790257)
    p = p * t + real(-0.14024059858554525)
    p = p * t + real(1.2375126308378275)
    return p / (real(1.0) + real(2.0) * x)
