#!/usr/bin/env python3
"""Reference values for the comparison of pictures: prints reference.txt. Needs python3-skimage (Debian), run in this folder.

The pictures: the temple with 1 and 64 samples a pixel, primitives with 1 and 4 (linear floats), a part of the texture
stones.png and the same blurred and of few levels, shapes and the same moved by a pixel, paler, its blue turned round, and
noise.

RMSE and PSNR, SSIM are scikit-image's: structural_similarity with the settings that its documentation gives for the paper
of Wang, Bovik, Sheikh and Simoncelli (2004): gaussian_weights, sigma 1.5, no sample covariance; on luma of Rec. 601.

FLIP: no package has the authors' program. This is a second implementation, from the paper (Andersson et al. 2020) with the
constants of the authors' code, which shares nothing with src/compare: it makes dense two-dimensional filters, of whole
pictures, as the authors' first release did, takes the inverse of the colour matrix numerically, and CIELAB as its standard
writes it. Published numbers that it is held to: the greatest distance of two colours to the power 0.7, 41.2761 in public
implementations of the metric; green against blue is 1. The authors' own test pictures aren't to be had here."""
import numpy as np
from PIL import Image
from scipy.ndimage import correlate
from skimage.metrics import mean_squared_error, peak_signal_noise_ratio, structural_similarity

PPD = 0.7 * 3840 / 0.7 * np.pi / 180
XYZ = np.array([[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
                [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
                [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]])
WHITE = XYZ @ np.ones(3)


def read(name):
    if name.endswith('.png'):
        return np.asarray(Image.open(name).convert('RGB')).astype(float) / 255
    data = open(name, 'rb').read()
    kind, size, scale, pixels = data.split(b'\n', 3)
    assert kind == b'PF' and float(scale) == -1
    width, height = map(int, size.split())
    return np.frombuffer(pixels, '<f4').reshape(height, width, 3)[::-1].astype(float)


def luma(rgb):
    return np.clip(rgb @ [0.299, 0.587, 0.114], 0, 1)


def ssim(a, b):
    return structural_similarity(luma(a), luma(b), gaussian_weights=True, sigma=1.5, use_sample_covariance=False,
                                 data_range=1.0)


def hunt_lab(rgb):
    ratio = (rgb @ XYZ.T) / WHITE
    f = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    lightness = 116 * f[..., 1] - 16
    a, b = 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])
    return np.stack([lightness, 0.01 * lightness * a, 0.01 * lightness * b], -1)


def hyab(p, q):
    d = p - q
    return np.abs(d[..., 0]) + np.hypot(d[..., 1], d[..., 2])


def grid(radius):
    return np.meshgrid(np.arange(-radius, radius + 1.0), np.arange(-radius, radius + 1.0))


def sensitivity(a1, b1, a2=0.0, b2=1e-5):
    x, y = grid(int(np.ceil(3 * np.sqrt(0.04 / (2 * np.pi ** 2)) * PPD)))
    d2 = (x ** 2 + y ** 2) / PPD ** 2
    s = a1 * np.sqrt(np.pi / b1) * np.exp(-np.pi ** 2 * d2 / b1) + a2 * np.sqrt(np.pi / b2) * np.exp(-np.pi ** 2 * d2 / b2)
    return s / s.sum()


def perceived(linear):
    ratio = (linear @ XYZ.T) / WHITE
    opponent = [116 * ratio[..., 1] - 16, 500 * (ratio[..., 0] - ratio[..., 1]), 200 * (ratio[..., 1] - ratio[..., 2])]
    filters = [sensitivity(1, 0.0047), sensitivity(1, 0.0053), sensitivity(34.1, 0.04, 13.5, 0.025)]
    y, cx, cz = (correlate(c, f, mode='nearest') for c, f in zip(opponent, filters))
    y = (y + 16) / 116
    blurred = (np.stack([y + cx / 500, y, y - cz / 200], -1) * WHITE) @ np.linalg.inv(XYZ).T
    return hunt_lab(np.clip(blurred, 0, 1))


def features(linear, kind):
    luminance = (linear @ XYZ.T)[..., 1] / WHITE[1]
    sigma = 0.5 * 0.082 * PPD
    x, y = grid(int(np.ceil(3 * sigma)))
    g = np.exp(-(x ** 2 + y ** 2) / (2 * sigma ** 2))
    f = -x * g if kind == 'edge' else (x ** 2 / sigma ** 2 - 1) * g
    f = np.where(f > 0, f / f[f > 0].sum(), f / -f[f < 0].sum())
    return np.hypot(correlate(luminance, f, mode='nearest'), correlate(luminance, f.T, mode='nearest'))


GREATEST = hyab(hunt_lab(np.array([0, 1.0, 0])), hunt_lab(np.array([0, 0, 1.0]))) ** 0.7


def flip(a, b, linear):
    a, b = np.clip(a, 0, 1), np.clip(b, 0, 1)
    if not linear:
        a, b = (np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4) for v in (a, b))
    distance = hyab(perceived(a), perceived(b)) ** 0.7
    knee = 0.4 * GREATEST
    colour = np.where(distance < knee, 0.95 * distance / knee,
                      0.95 + 0.05 * (distance - knee) / (GREATEST - knee))
    feature = np.sqrt(np.maximum(*(np.abs(features(a, k) - features(b, k)) for k in ('edge', 'point'))) / np.sqrt(2))
    return np.mean(colour ** (1 - feature))


assert round(float(GREATEST), 4) == 41.2761
green, blue = np.zeros((30, 30, 3)), np.zeros((30, 30, 3))
green[..., 1], blue[..., 2] = 1, 1
assert abs(flip(green, blue, False) - 1) < 1e-9
for a, b, linear in [('temple_1.png', 'temple_64.png', 0), ('stones.png', 'stones_blurred.png', 0),
                     ('shapes.png', 'shapes_moved.png', 0), ('shapes.png', 'shapes_moved.png', 1),
                     ('noise_a.png', 'noise_b.png', 0), ('primitives_1.pfm', 'primitives_4.pfm', 1)]:
    p, q = read(a), read(b)
    print(a, b, linear, '%.12f %.10f %.12f %.12f' % (np.sqrt(mean_squared_error(p, q)),
                                                    peak_signal_noise_ratio(p, q, data_range=1), ssim(p, q),
                                                    flip(p, q, linear)))
