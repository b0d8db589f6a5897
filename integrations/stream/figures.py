"""What the page's log says: see README.md."""


SETTLING = 2  # seconds in which the page catches up with the stream that it has come to


def percentile(values, share):
    """The smallest of the values that so many are at most."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def of(pictures):
    """Of pictures in the order in which they were shown, each with number, made, arrived and shown (milliseconds)."""
    pictures = [each for each in pictures if each["shown"] >= pictures[0]["shown"] + SETTLING * 1000]
    numbers = [picture["number"] for picture in pictures]
    gaps = [b["arrived"] - a["arrived"] for a, b in zip(pictures, pictures[1:])]
    shown_gaps = [b["shown"] - a["shown"] for a, b in zip(pictures, pictures[1:])]
    seconds = (pictures[-1]["shown"] - pictures[0]["shown"]) / 1000
    return {
        "pictures": len(pictures),
        "seconds": seconds,
        "in_order": all(a < b for a, b in zip(numbers, numbers[1:])),
        "missing": max(numbers) - min(numbers) + 1 - len(set(numbers)),
        "a_second": (len(pictures) - 1) / seconds,
        "arrival_gaps": [percentile(gaps, share) for share in (0.5, 0.95, 0.99, 1)],
        "shown_gaps": [percentile(shown_gaps, share) for share in (0.5, 0.95, 0.99, 1)],
        "gaps_below_50_ms": sum(gap < 50 for gap in shown_gaps) / len(shown_gaps),
        "to_arrival": [percentile([p["arrived"] - p["made"] for p in pictures], share) for share in (0.5, 0.95)],
        "to_picture": [percentile([p["shown"] - p["made"] for p in pictures], share) for share in (0.5, 0.95)],
        "kilobits_a_second": sum(picture["bytes"] for picture in pictures) * 8 / 1000 / seconds,
    }


def text(measured):
    list_of = lambda values: ", ".join(f"{value:.1f}" for value in values)
    order = "in order" if measured["in_order"] else "not in order"
    return "\n".join([
        f"{measured['pictures']} pictures in {measured['seconds']:.1f} s, {order}, {measured['missing']} missing",
        f"{measured['a_second']:.2f} a second, {measured['kilobits_a_second']:.0f} kbit/s",
        f"ms between arrivals, median, 95th, 99th percentile and most: {list_of(measured['arrival_gaps'])}",
        f"ms between pictures: {list_of(measured['shown_gaps'])}; {100 * measured['gaps_below_50_ms']:.1f} % below 50",
        f"ms from the renderer's frame to arrival, median and 95th percentile: {list_of(measured['to_arrival'])}",
        f"ms from the renderer's frame to the picture: {list_of(measured['to_picture'])}",
    ])


def goal(measured, frame_rate):
    """All there, in order, as many as were rendered but for one in sixty, and no stutter."""
    complete = measured["in_order"] and measured["missing"] == 0
    return complete and measured["a_second"] >= frame_rate * 59 / 60 and measured["gaps_below_50_ms"] >= 0.95
