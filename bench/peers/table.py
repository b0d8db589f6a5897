"""Medians, ratios and the tables of what has been measured.

A result is a dictionary: `model`, `part` ("network" or "frame"), `numbers` ("fp32", "int8" or "bf16", what it is
computed in), and for `clarus` and each of `peers` a dictionary with `seconds` (of every timed run) and `difference`, or
`error`. A peer's `beside`, where it has one, are Clarus's seconds in the same rounds.
"""

import statistics

from compare import agrees

PARTS = ("network", "frame")


def bar(result):
    if result["part"] == "frame":
        return 2.0
    return 1.5 if result["numbers"] == "fp32" else 1.3


def score(entry, numbers):
    """(median, spread) of an entry in seconds, the spread half of what lies between the quartiles.

    None where it could not run or its output is wrong.
    """
    if "error" in entry or not agrees(entry["difference"], numbers):
        return None
    seconds = entry["seconds"]
    if len(seconds) < 2:
        return seconds[0], 0.0
    first, median, third = statistics.quantiles(seconds, n=4, method="inclusive")
    return median, (third - first) / 2


def verdict(result):
    """How many times as long as Clarus in the same rounds the fastest peer takes, its name, and whether the bar is met.

    The ratio is None where either side has no score; then no bar is met.
    """
    numbers = result["numbers"]
    scored = {name: score(entry, numbers) for name, entry in result["peers"].items()}
    medians = {name: each[0] for name, each in scored.items() if each}
    own = score(result["clarus"], numbers)
    if not medians or own is None:
        return {"ratio": None, "fastest": None, "met": False}
    fastest = min(medians, key=medians.get)
    beside = result["peers"][fastest].get("beside")
    ratio = medians[fastest] / (statistics.median(beside) if beside else own[0])
    return {"ratio": ratio, "fastest": fastest, "met": ratio >= bar(result)}


def cell(entry, numbers):
    scored = score(entry, numbers)
    if scored:
        return f"{1e3 * scored[0]:.2f} ± {1e3 * scored[1]:.2f}"
    return "–" if "error" in entry else "wrong"


def rows(results):
    """The table's cells, its header first."""
    peers = list(dict.fromkeys(name for result in results for name in result["peers"]))
    table = [["model", "what", *(f"{name} ms" for name in peers), "Clarus ms", "ratio", "bar"]]
    for result in results:
        judged = verdict(result)
        ratio = "–" if judged["ratio"] is None else f"{judged['ratio']:.2f} ({judged['fastest']})"
        met = f"{bar(result):g}× {'met' if judged['met'] else 'not met'}"
        numbers = result["numbers"]
        cells = [cell(result["peers"][name], numbers) if name in result["peers"] else "" for name in peers]
        table.append([result["model"], result["part"], *cells, cell(result["clarus"], numbers), ratio, met])
    return table


def remarks(results):
    """Why a cell has no figure, how far results are from PyTorch's, and how a peer was set up."""
    lines = []
    for result in results:
        for name, entry in {**result["peers"], "Clarus": result["clarus"]}.items():
            where = f"{result['model']} {result['part']}, {name}"
            if "error" in entry:
                lines.append(f"{where}: {entry['error']}")
                continue
            off = entry["difference"]
            wrong = "" if agrees(off, result["numbers"]) else "; WRONG, hence no score"
            way = f"; {entry['way']}" if entry.get("way") else ""
            lines.append(f"{where}: off by {off['typical']:.1e}, at most {off['largest']:.1e}{wrong}{way}")
    return lines


def text(results):
    table = rows(results)
    widths = [max(len(row[column]) for row in table) for column in range(len(table[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in table]
    return "\n".join([*lines, "", *remarks(results)])


def markdown(results):
    header, *body = rows(results)
    lines = [header, ["---"] * len(header), *body]
    table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    return table + "\n\n" + "\n".join(f"- {line}" for line in remarks(results))
