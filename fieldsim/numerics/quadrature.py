"""Gauss's quadrature: the nodes and weights of every rule, for portable functions (correctly rounded) and for NumPy.

A rule of n nodes is exact for polynomials of degree 2 n - 1. `legendre_8(k)` gives a portable function the constants of
node k; in a loop that compilers unroll they are literals. (Golub & Welsch 1969; the numbers are from 60 digits.)
"""

import functools

import numpy as np

from fieldsim.portable import Portable, hole, portable, real

# On -1..1: the positive nodes and their weights, from the middle outward.
LEGENDRE = {
    4: (
        (0.33998104358485626, 0.6521451548625461),
        (0.8611363115940526, 0.34785484513745385),
    ),
    8: (
        (0.1834346424956498, 0.362683783378362),
        (0.525532409916329, 0.31370664587788727),
        (0.7966664774136267, 0.22238103445337448),
        (0.9602898564975363, 0.10122853629037626),
    ),
    12: (
        (0.1252334085114689, 0.24914704581340277),
        (0.3678314989981802, 0.2334925365383548),
        (0.5873179542866175, 0.20316742672306592),
        (0.7699026741943047, 0.16007832854334622),
        (0.9041172563704749, 0.10693932599531843),
        (0.9815606342467192, 0.04717533638651183),
    ),
    16: (
        (0.09501250983763744, 0.1894506104550685),
        (0.2816035507792589, 0.18260341504492358),
        (0.45801677765722737, 0.16915651939500254),
        (0.6178762444026438, 0.14959598881657674),
        (0.755404408355003, 0.12462897125553388),
        (0.8656312023878318, 0.09515851168249279),
        (0.9445750230732326, 0.062253523938647894),
        (0.9894009349916499, 0.027152459411754096),
    ),
    24: (
        (0.06405689286260563, 0.12793819534675216),
        (0.1911188674736163, 0.1258374563468283),
        (0.3150426796961634, 0.12167047292780339),
        (0.4337935076260451, 0.1155056680537256),
        (0.5454214713888396, 0.10744427011596563),
        (0.6480936519369755, 0.09761865210411388),
        (0.7401241915785544, 0.08619016153195327),
        (0.820001985973903, 0.0733464814110803),
        (0.8864155270044011, 0.05929858491543678),
        (0.9382745520027328, 0.04427743881741981),
        (0.9747285559713095, 0.028531388628933663),
        (0.9951872199970213, 0.0123412297999872),
    ),
}
# On 0..1: all nodes and their weights.
UNIT_LEGENDRE = {
    2: (
        (0.2113248654051871, 0.5),
        (0.7886751345948129, 0.5),
    ),
    4: (
        (0.06943184420297371, 0.17392742256872692),
        (0.33000947820757187, 0.32607257743127305),
        (0.6699905217924281, 0.32607257743127305),
        (0.9305681557970263, 0.17392742256872692),
    ),
    6: (
        (0.03376524289842399, 0.08566224618958518),
        (0.16939530676686773, 0.1803807865240693),
        (0.38069040695840156, 0.23395696728634552),
        (0.6193095930415985, 0.23395696728634552),
        (0.8306046932331322, 0.1803807865240693),
        (0.966234757101576, 0.08566224618958518),
    ),
    8: (
        (0.019855071751231884, 0.05061426814518813),
        (0.10166676129318664, 0.11119051722668724),
        (0.2372337950418355, 0.15685332293894363),
        (0.4082826787521751, 0.181341891689181),
        (0.591717321247825, 0.181341891689181),
        (0.7627662049581645, 0.15685332293894363),
        (0.8983332387068134, 0.11119051722668724),
        (0.9801449282487681, 0.05061426814518813),
    ),
}
# On 0..1 with the weight 2 s: all nodes and their weights (Gauss-Jacobi).
UNIT_JACOBI = {
    2: (
        (0.3550510257216822, 0.36391723651204566),
        (0.8449489742783178, 0.6360827634879543),
    ),
    4: (
        (0.13975986434378054, 0.06236194190001616),
        (0.41640956763108317, 0.2596950952164649),
        (0.7231569863618762, 0.4069291360205427),
        (0.9428958038854823, 0.27101382686297626),
    ),
    6: (
        (0.07305432868025888, 0.017476603627219065),
        (0.2307661379699455, 0.08791033110101795),
        (0.44132848122844986, 0.19732230178131052),
        (0.6630153097188457, 0.2815851075763979),
        (0.8519214003315158, 0.27108499446303724),
        (0.9706835728402151, 0.14462066145101737),
    ),
}

X_0 = X_1 = X_2 = X_3 = X_4 = X_5 = X_6 = X_7 = X_8 = X_9 = X_10 = X_11 = hole()
W_0 = W_1 = W_2 = W_3 = W_4 = W_5 = W_6 = W_7 = W_8 = W_9 = W_10 = W_11 = hole()


@portable
def _node(k: int):
    """Node and weight k of a table, of twelve at most."""
    if k == 0:
        return real(X_0), real(W_0)
    if k == 1:
        return real(X_1), real(W_1)
    if k == 2:
        return real(X_2), real(W_2)
    if k == 3:
        return real(X_3), real(W_3)
    if k == 4:
        return real(X_4), real(W_4)
    if k == 5:
        return real(X_5), real(W_5)
    if k == 6:
        return real(X_6), real(W_6)
    if k == 7:
        return real(X_7), real(W_7)
    if k == 8:
        return real(X_8), real(W_8)
    if k == 9:
        return real(X_9), real(W_9)
    if k == 10:
        return real(X_10), real(W_10)
    return real(X_11), real(W_11)


def _served(table) -> Portable:
    """Portable k -> (node, weight) of a table's pairs."""
    filled = [*table, *[(0.0, 0.0)] * (12 - len(table))]
    names = {f"X_{k}": node for k, (node, _weight) in enumerate(filled)}
    return _node.bind(**names, **{f"W_{k}": weight for k, (_node, weight) in enumerate(filled)})


# Portable k -> (the positive node k of n on -1..1, from the middle outward, its weight).
legendre_4, legendre_8, legendre_12, legendre_16, legendre_24 = map(_served, LEGENDRE.values())
# Portable k -> (node k of n on 0..1, its weight).
unit_legendre_2, unit_legendre_4, unit_legendre_6, unit_legendre_8 = map(_served, UNIT_LEGENDRE.values())
# The same for the weight 2 s on 0..1.
unit_jacobi_2, unit_jacobi_4, unit_jacobi_6 = map(_served, UNIT_JACOBI.values())


@functools.cache
def _legendre(count):
    return np.polynomial.legendre.leggauss(count)


def gauss_legendre(count: int, low: float = 0.0, high: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (count,) and weights (count,) of the rule of any order on low..high. Error 1e-15 of the range (NumPy's)."""
    nodes, weights = _legendre(count)
    return 0.5 * (low + high) + 0.5 * (high - low) * nodes, 0.5 * (high - low) * weights
