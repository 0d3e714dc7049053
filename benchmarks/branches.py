import numpy as np
from scipy.optimize import least_squares

rng = np.random.default_rng(1)


def maxwell(p, w, n):
    g = np.exp(p[:n])
    t = np.exp(p[n : 2 * n])
    s = (g * 1j * w[:, None] * t / (1 + 1j * w[:, None] * t)).sum(1)
    return np.exp(p[-1]) * (1 + s)


def fit(K, w, n):
    best = None
    for k in range(3):
        t0 = (
            np.log(1 / np.geomspace(w.max(), w.min(), n + 2)[1:-1])
            if n > 1
            else np.log([1 / np.sqrt(w.max() * w.min())])
        )
        p0 = np.r_[
            np.full(n, np.log(0.1)) + 0.5 * rng.standard_normal(n),
            t0 + 0.3 * rng.standard_normal(n),
            np.log(abs(K).min()),
        ]
        r = least_squares(lambda p: (lambda d: np.r_[d.real, d.imag])((maxwell(p, w, n) - K) / abs(K)), p0)
        if best is None or r.cost < best:
            best = r.cost
    return np.sqrt(2 * best / len(w))


def plain(K, w):
    k = np.sum((1 / abs(K)) * (K / abs(K)).real) / np.sum(1 / abs(K) ** 2)
    return np.sqrt(np.mean(abs(k / K - 1) ** 2))


out = {1: [], 2: [], 3: []}
for i in range(200):
    lo = 10 ** rng.uniform(-1, 0.5)
    hi = 10 ** rng.uniform(1.7, 2.6)
    w = 2 * np.pi * np.geomspace(lo, hi, 16)
    kind = i % 3
    b = rng.uniform(0.15, 0.6)
    if kind == 0:  # fractional Kelvin-Voigt
        K = 1 + rng.uniform(0.05, 0.5) * (1j * w / 30) ** b
    elif kind == 1:  # Cole-Cole
        z = (1j * w * 10 ** rng.uniform(-4, -1)) ** b
        K = 1 + rng.uniform(0.2, 2) * z / (1 + z)
    else:  # fractional Zener w/ Havriliak-Negami
        z = 1j * w * 10 ** rng.uniform(-4, -1)
        K = 1 + rng.uniform(0.2, 2) * (1 - 1 / (1 + z**b) ** rng.uniform(0.4, 1))
    P = plain(K, w)
    for n in (1, 2, 3):
        out[n].append((kind, fit(K, w, n) / P, P, fit(K, w, n)))
for n in out:
    a = np.array(out[n])
    print(
        n,
        [
            (
                np.round(np.quantile(a[a[:, 0] == k, 1], [0.1, 0.5, 0.9]), 4),
                np.round(np.quantile(a[a[:, 0] == k, 3], [0.5, 0.9]), 4),
            )
            for k in range(3)
        ],
        "all",
        np.median(a[:, 1]),
        np.std(np.log(a[:, 1])),
    )
