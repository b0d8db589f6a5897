"""A Chrome trace of all who had a part in a stream, of those that the game and the upscaler wrote and of the page's log."""

import json

CLOCK = "began"  # of a trace, in microseconds since 1970


def of(traces, pictures):
    """`traces`: by name; `pictures`: of the log, which may be empty. Frames are named as in the traces."""
    events = []
    start = min(trace["otherData"][CLOCK] for trace in traces.values())
    for process, (name, trace) in enumerate(traces.items(), 1):
        events.append({"name": "process_name", "ph": "M", "pid": process, "args": {"name": name}})
        for event in trace["traceEvents"]:
            event["pid"] = process
            if "ts" in event:
                event["ts"] += trace["otherData"][CLOCK] - start
            events.append(event)
    process = len(traces) + 1
    if pictures:
        events.append({"name": "process_name", "ph": "M", "pid": process, "args": {"name": "the page"}})
    for picture in pictures:
        arrived, shown = (picture[key] * 1000 - start for key in ("arrived", "shown"))
        # Numbers of fragments begin with 1, the upscaler's first frame with the stream's.
        events.append({"name": "decode and show", "ph": "X", "pid": process, "tid": 1, "ts": arrived,
                       "dur": shown - arrived, "args": {"frame": f"{picture['number'] - 1:04}"}})
    return {"traceEvents": events, "displayTimeUnit": "ms", "otherData": {CLOCK: start}}


def steps(timeline):
    """The median milliseconds of each step of a frame's way: {name: milliseconds}, in the order of time. From the end of
    one step to the beginning of the next are the ways between processes."""
    spans = {}
    for event in timeline["traceEvents"]:
        if event["ph"] == "X":
            spans.setdefault(event["args"]["frame"], {})[event["name"]] = event
    whole = [frame for frame in spans.values() if {"copy into the slot", "submit", "encode", "decode and show"} <= set(frame)]
    if not whole:
        return {}

    def median(length):
        return sorted(length(frame) for frame in whole)[len(whole) // 2] / 1000

    def way(start, end):
        return lambda frame: frame[end]["ts"] - frame[start]["ts"] - frame[start]["dur"]

    def length(name):
        return lambda frame: frame[name]["dur"] if name in frame else 0

    return {
        "render, or read": median(length("render")),
        "copy into the slot": median(length("copy into the slot")),
        "to the upscaler": median(way("copy into the slot", "submit")),
        "upscale": median(lambda frame: frame["encode"]["ts"] - frame["submit"]["ts"]),
        "encode": median(length("encode")),
        "to the page": median(way("encode", "decode and show")),
        "decode and show": median(length("decode and show")),
    }


def write(file, traces, pictures):
    """What it has written."""
    timeline = of({name: json.loads(path.read_text()) for name, path in traces.items()}, pictures)
    file.write_text(json.dumps(timeline))
    return timeline
