#!/usr/bin/env python3
"""Compares a resampling scheme written in Python with those of the library.

By the variance of the copies, by time, and by the error of FastSLAM on a simulated drive. Prints a table and writes
the picture that is named on the command line (default: scheme_in_python.png).
"""

import sys
import time

import matplotlib
import numpy as np

import pf_resampling_core as pf

matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402


def metropolis(weights, size, stream):
    """Metropolis resampling (Murray 2012), which never sums the weights: how often each particle is taken."""
    steps = 30
    taken = np.arange(size) % len(weights)
    for others, accepts in stream.uniform(2 * steps * size).reshape(steps, 2, size):
        others = (others * len(weights)).astype(int)
        taken = np.where(accepts * weights[taken] <= weights[others], others, taken)
    return np.bincount(taken, minlength=len(weights))


def copies(resampler, size=1000, draws=200):
    """Mean squared difference of the copies to size * weight, and microseconds a draw."""
    weights = np.random.default_rng(1).exponential(size=size)
    expected = size * weights / weights.sum()
    begin = time.perf_counter()
    counts = [resampler.resample(weights, pf.RandomStream(1, draw)).counts for draw in range(draws)]
    duration = time.perf_counter() - begin
    return np.mean((np.array(counts) - expected) ** 2), 1e6 * duration / draws


def drive(seed, scheme, own_scheme):
    """Path of FastSLAM on two rounds of a circle among twelve landmarks, and the true one: (x, y), m."""
    angles = np.arange(12) * 2.0 * np.pi / 12.0
    landmarks = np.stack([7.0 * np.sin(angles), 5.0 - 7.0 * np.cos(angles)], axis=1)
    random = np.random.default_rng(seed)
    parameters = {'preset': 'fast', 'particles': 300}
    parameters.update({'population/resampling/scheme': scheme} if scheme else {})
    slam = pf.FastSlam(parameters, seed=seed, own_scheme=own_scheme)
    x, y, heading, truth = 0.0, 0.0, 0.0, []
    for _ in range(250):
        x, y, heading = x + 0.25 * np.cos(heading + 0.025), y + 0.25 * np.sin(heading + 0.025), heading + 0.05
        slam.predict((0.25 + 0.03 * random.normal(), 0.03 * random.normal(), 0.05 + 0.01 * random.normal()), 0.5)
        ahead = (landmarks - (x, y)) @ np.array([[np.cos(heading), -np.sin(heading)],
                                                 [np.sin(heading), np.cos(heading)]])
        ids = np.flatnonzero(np.hypot(*ahead.T) < 6.0)
        slam.update(np.hypot(*ahead[ids].T) + 0.1 * random.normal(size=ids.size),
                    np.arctan2(ahead[ids, 1], ahead[ids, 0]) + 0.03 * random.normal(size=ids.size), ids)
        truth.append((x, y))
    return slam.path()[:, :2], np.array(truth)


def main():
    schemes = [(name, None) for name in pf.resampling_schemes()] + [(None, metropolis)]
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5))
    print('%-26s %18s %10s %15s' % ('scheme', 'variance of copies', 'us a draw', 'error (m)'))
    for scheme, own_scheme in schemes:
        name = scheme or 'metropolis, in Python'
        variance, duration = copies(pf.Resampler(scheme=scheme) if scheme else pf.Resampler(own_scheme=own_scheme))
        drives = [drive(seed, scheme, own_scheme) for seed in range(10)]
        errors = [np.sqrt(np.mean(np.sum((path - truth) ** 2, axis=1))) for path, truth in drives]
        print('%-26s %18.3f %10.1f %7.3f ± %.3f' % (name, variance, duration, np.mean(errors),
                                                    np.std(errors) / np.sqrt(len(errors) - 1)))
        left.barh(name, variance)
    left.set_xlabel('variance of the copies')
    right.plot(*drives[-1][1].T, 'k', label='truth')
    right.plot(*drives[-1][0].T, label='FastSLAM with the scheme in Python')
    right.set(xlabel='x (m)', ylabel='y (m)', aspect='equal')
    right.legend(loc='upper center')
    figure.tight_layout()
    figure.savefig(sys.argv[1] if len(sys.argv) > 1 else 'scheme_in_python.png')


if __name__ == '__main__':
    main()
