"""Motions: half a sum of sines, three tenths slow ramps there and back, a fifth a chirp, joined by quintic moves."""
import numpy as np

RATE = 1000  # rows a second
SPEED, ACCELERATION = 4.5, 45.0  # rad/s and rad/s2, the sum of sines' limits


def _window(t, edge):
    return np.minimum(1, np.minimum(t, t[-1] - t) / edge)


def _sines(random, duration, reach):
    t = np.arange(int(duration * RATE)) / RATE
    count = random.integers(6, 10)
    frequency = np.sort(random.uniform(0.1, 2.0, count))
    amplitude = random.uniform(0.4, 1, count) / (0.4 + frequency)
    phase = random.uniform(0, 2 * np.pi, count)
    y = sum(amplitude[k] * np.sin(2 * np.pi * frequency[k] * t + phase[k]) for k in range(count))
    y *= random.uniform(0.9, 1.0) * reach / np.abs(y).max()
    speed = np.gradient(y, 1 / RATE)
    y *= min(1, SPEED / np.abs(speed).max(), ACCELERATION / np.abs(np.gradient(speed, 1 / RATE)).max())
    y += random.uniform(-0.2, 0.2)
    window = _window(t, 0.7)
    return y[0] + (y - y[0]) * window**2 * (3 - 2 * window)


def _ramps(random, duration, reach):
    """Ramps there and back at 0.02 to 1 rad/s, one after the other."""
    left, limit = duration, 0.95 * reach
    while left > 0.5:
        speed = np.exp(random.uniform(np.log(0.02), np.log(1.0)))
        lasts = min(random.uniform(2, 4.5), left)
        left -= lasts
        sign = random.choice([-1, 1])
        half = speed * lasts / 2
        centre = random.uniform(half - limit, limit - half) if half < limit else 0
        start = centre - sign * half / 2
        there = start + sign * speed * np.arange(int(lasts / 2 * RATE)) / RATE
        yield np.concatenate([there, there[-1] - sign * speed * np.arange(len(there)) / RATE])


def _chirp(random, duration, low=0.3, high=3.0):
    t = np.arange(int(duration * RATE)) / RATE
    phase = 2 * np.pi * (low * t + (high - low) * t * t / 2 / duration)
    omega = 2 * np.pi * (low + (high - low) * t / duration)
    widest = 0.8 * random.uniform(0.8, 1.2)
    amplitude = np.minimum(widest, np.minimum(4 / omega, 60 / omega**2) * random.uniform(0.8, 1.0))
    return random.uniform(-0.6, 0.6) + amplitude * np.sin(phase) * _window(t, 0.3)


def motion(random, duration, reach):
    """Reference position in rad, a value a row."""
    parts = [np.zeros(300)]

    def go(end):
        start = parts[-1][-1]
        rows = int(max(0.6, abs(end - start) * 1.2) * RATE)
        s = np.arange(rows) / rows
        parts.append(start + (end - start) * (10 * s**3 - 15 * s**4 + 6 * s**5))

    sines = _sines(random, 0.5 * duration, reach)
    go(sines[0])
    parts.append(sines)
    for ramp in _ramps(random, 0.3 * duration, reach):
        go(ramp[0])
        parts.append(ramp)
    chirp = _chirp(random, 0.2 * duration)
    go(chirp[0])
    parts += [chirp]
    go(0.0)
    parts.append(np.zeros(200))
    # A mean over 20 ms rounds the corners, as the interpolator of a motion controller does.
    return np.convolve(np.pad(np.concatenate(parts), (10, 9), mode="edge"), np.ones(20) / 20, "valid")
