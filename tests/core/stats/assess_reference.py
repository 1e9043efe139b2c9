#!/usr/bin/python3
"""The numbers of test_assess.c, by numpy and scipy: assess_reference.py

Platt scaling by a general minimizer, intervals of areas under curves by root finding, McNemar's test by the binomial
distribution. The evidence is that of the test.
"""
import numpy as np
from scipy.optimize import brentq, minimize
from scipy.stats import binom, norm


def evidence(n, classes):
    """As in the test: exact in double precision."""
    table = np.array([[(37 * i + 11 * c * c + 5 * i * c) % 29 for c in range(classes)] for i in range(n)]) / 4 - 3
    labels = np.array([(i * i + i // 3) % classes for i in range(n)])
    table[np.arange(n), labels] += 2.5
    return table, labels


def platt(table, labels, weights):
    n, classes = table.shape
    count = np.array([weights[labels == c].sum() for c in range(classes)])
    target = np.array([[(count[y] + 1 if c == y else 1) / (count[y] + classes) for c in range(classes)] for y in labels])

    def loss(p):
        z = p[0] * table + np.r_[0, p[1:]]
        return (weights * (np.log(np.exp(z - z.max(1, keepdims=True)).sum(1)) + z.max(1) - (target * z).sum(1))).sum()

    best = minimize(loss, np.r_[0.1, np.zeros(classes - 1)], method='BFGS', options={'gtol': 1e-12})
    best = minimize(loss, best.x, method='Nelder-Mead', options={'xatol': 1e-13, 'fatol': 1e-15, 'maxiter': 20000})
    return best.x, (weights[:, None] * target).sum(0) / weights.sum()


def auc_interval(auc, m, n):
    h = (m + n) / 2 - 1

    def gap(a):
        v = a * (1 - a) * (1 + h * (1 - a) / (2 - a) + h * a / (1 + a)) / (m * n)
        return (auc - a) ** 2 - norm.ppf(0.975) ** 2 * v

    low = brentq(gap, 1e-12, auc - 1e-9, xtol=1e-14) if auc > 0 else 0
    high = brentq(gap, auc + 1e-9, 1 - 1e-12, xtol=1e-14) if auc < 1 else 1
    return low, high


for classes, subjects in ((2, None), (3, None), (3, 'pairs')):
    table, labels = evidence(24, classes)
    if subjects:
        labels = labels[np.arange(24) // 2 * 2]
    weights = np.full(24, 0.5 if subjects else 1.0)
    p, target = platt(table, labels, weights)
    print('platt', classes, subjects, [f'{x:.9f}' for x in p], [f'{x:.12f}' for x in target])
    z = p[0] * table + np.r_[0, p[1:]] + np.log(1 / classes / target)
    q = np.exp(z - z.max(1, keepdims=True))
    q /= q.sum(1, keepdims=True)
    one = np.eye(classes)[labels]
    share = one.mean(0)
    w = 1 / classes / share[labels] / 24
    print('  brier', (0.5 * w[:, None] * (q - one) ** 2).sum(), 'log loss', -(w * np.log(q[np.arange(24), labels])).sum())
    lead = [table[:, c] - np.delete(table, c, 1).max(1) for c in range(classes)]
    for c in range(classes):
        pos, neg = lead[c][labels == c], lead[c][labels != c]
        a = ((pos[:, None] > neg) + 0.5 * (pos[:, None] == neg)).mean()
        m, n = (len(pos) / 2, len(neg) / 2) if subjects else (len(pos), len(neg))
        print('  auc', c, f'{a:.12f}', [f'{x:.10f}' for x in auc_interval(a, m, n)])
for auc, m, n in ((1.0, 10, 12), (0.5, 30, 40), (0.83, 25, 25)):
    print('interval', auc, m, n, [f'{x:.10f}' for x in auc_interval(auc, m, n)])
for b, c in ((1, 8), (3, 4), (0, 5)):
    print('mcnemar', b, c, min(1.0, 2 * binom.cdf(min(b, c), b + c, 0.5)))
