"""Quality over time, as SRPO's figure 8 has it: an SVG of methods in floating point, hollow, and in int8, filled."""

import json
import math

INT8 = "-int8"
COLORS = ["#440154", "#31688e", "#1f9e89", "#35b779", "#b5a800", "#d1495b", "#7a7a7a", "#e07b00"]
WIDTH, HEIGHT, LEFT, TOP = 300, 260, 70, 40  # of a panel and its margins, in pixels


def times_of(path):
    """Milliseconds of each model, of a result of `clarus bench -o`: its first device, the largest output there is."""
    with open(path) as file:
        bench = json.load(file)
    device = bench["devices"][0]["profile"]["selector"]
    items = [item for item in bench["items"] if item["device"] == device and item["score"]]
    size = max((item["output_size"] for item in items), default=None)
    return {item["model"]["name"]: 1e3 * item["score"]["latency"]["median"] for item in items if item["output_size"] == size}


def ticks(low, high, logarithmic):
    if logarithmic:
        marks = [m * 10.0**e for e in range(-3, 6) for m in (1, 2, 5)]
        return [mark for mark in marks if low <= mark <= high]
    step = 10 ** math.floor(math.log10(high - low))
    step = next(part * step for part in (0.1, 0.2, 0.5, 1.0, 2.0) if (high - low) / (part * step) <= 6)
    return [step * n for n in range(math.ceil(low / step), math.floor(high / step) + 1)]


class Axis:
    """From values to pixels, with some room at either end."""

    def __init__(self, values, start, end, logarithmic=False):
        self.scale = math.log if logarithmic else float
        low, high = self.scale(min(values)), self.scale(max(values))
        room = 0.08 * (high - low) or 0.5
        self.low, self.high, self.start, self.end = low - room, high + room, start, end
        limits = [math.exp(each) if logarithmic else each for each in (self.low, self.high)]
        self.ticks = ticks(*limits, logarithmic)

    def at(self, value):
        share = (self.scale(value) - self.low) / (self.high - self.low)
        return self.start + share * (self.end - self.start)


def panel(title, points, left, colors):
    """`points`: {model: (milliseconds, figure)}."""
    x = Axis([each[0] for each in points.values()], left, left + WIDTH, logarithmic=True)
    y = Axis([each[1] for each in points.values()], TOP + HEIGHT, TOP)
    parts = [f'<rect x="{left}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#888"/>']
    parts.append(f'<text x="{left}" y="{TOP - 12}">{title}, over ms a frame</text>')
    for mark in x.ticks:
        parts.append(f'<text x="{x.at(mark):.1f}" y="{TOP + HEIGHT + 16}" text-anchor="middle">{mark:g}</text>')
    for mark in y.ticks:
        parts.append(f'<text x="{left - 6}" y="{y.at(mark) + 4:.1f}" text-anchor="end">{mark:g}</text>')
    for model, (ms, figure) in points.items():
        color = colors[model.removesuffix(INT8)]
        here = x.at(ms), y.at(figure)
        if model + INT8 in points:
            there = points[model + INT8]
            parts.append(
                f'<line x1="{here[0]:.1f}" y1="{here[1]:.1f}" x2="{x.at(there[0]):.1f}" y2="{y.at(there[1]):.1f}" stroke="{color}"/>'
            )
        fill = color if model.endswith(INT8) else "#fff"
        parts.append(f'<circle cx="{here[0]:.1f}" cy="{here[1]:.1f}" r="5" fill="{fill}" stroke="{color}" stroke-width="2"/>')
    return parts


def plot(figures, times):
    """`figures`: {model: {"psnr", "ssim"}}; `times`: {model: milliseconds}. Models without a time are left out."""
    shown = [model for model in figures if model in times]
    kinds = list(dict.fromkeys(model.removesuffix(INT8) for model in shown))
    colors = {kind: COLORS[i % len(COLORS)] for i, kind in enumerate(kinds)}
    width, height = 2 * (LEFT + WIDTH) + 20, TOP + HEIGHT + 30 + 20 * math.ceil(len(kinds) / 4) + 10
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">',
        '<rect width="100%" height="100%" fill="#fff"/>',
    ]
    for i, (name, title) in enumerate((("psnr", "PSNR, dB"), ("ssim", "SSIM"))):
        points = {model: (times[model], figures[model][name]) for model in shown}
        parts += panel(title, points, LEFT + i * (LEFT + WIDTH), colors)
    for i, kind in enumerate(kinds):
        x, y = LEFT + i % 4 * 165, TOP + HEIGHT + 40 + i // 4 * 20
        parts.append(f'<circle cx="{x}" cy="{y - 4}" r="5" fill="{colors[kind]}"/><text x="{x + 10}" y="{y}">{kind}</text>')
    return "\n".join([*parts, "</svg>", ""])
