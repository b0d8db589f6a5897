"""A game, its upscaler, a relay and a page in a browser, all on loopback. See README.md."""

import argparse
import asyncio
import contextlib
import functools
import http.server
import json
import os
import shutil
import signal
import sys
import tempfile
import threading
from pathlib import Path

import moq

import figures
import timeline

HERE = Path(__file__).resolve().parent
TREE = HERE.parent.parent
LOOPBACK = "127.0.0.1"
NAME = "game"


def arguments():
    parser = argparse.ArgumentParser(prog="./run stream", description="Streams the sample renderer's frames, upscaled, "
                                     "to a page in a browser. Everything is on loopback. Ctrl-C ends it.")
    parser.add_argument("--model", default="enss-s-x2", help="what upscales [%(default)s]")
    parser.add_argument("--scene", default="demo", help="clarus render --scene [%(default)s]")
    parser.add_argument("--play", metavar="SEQUENCE", help="a recorded sequence as the game, again and again")
    parser.add_argument("--size", default="320x180", help="render size [%(default)s]")
    parser.add_argument("--frame-rate", type=float, default=30, help="the game's [%(default)s]")
    parser.add_argument("--device", default="auto", help="clarus serve --device [%(default)s]")
    parser.add_argument("--measure", type=float, metavar="SECONDS",
                        help="open the page in a headless Chromium for so long, print when pictures came, and end; "
                             "exits with 1 where the goal is missed")
    parser.add_argument("--log", type=Path, metavar="FILE", help="with --measure: what the page noted, as JSON")
    parser.add_argument("--trace", type=Path, metavar="FILE",
                        help="a timeline of rendering, sharing, upscaling and encoding, with --measure of arrival as "
                             "well, for `clarus report --trace` or ui.perfetto.dev")
    parser.add_argument("--tool", default=TREE / "build/bin/clarus", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.log and not options.measure:
        parser.error("--log is of --measure")
    return options


class Page(http.server.SimpleHTTPRequestHandler):
    """The page's files, stream.json, and a place for the page's log."""

    def __init__(self, *rest, stream, take_log, **named):
        self.stream, self.take_log = stream, take_log
        super().__init__(*rest, directory=HERE, **named)

    def do_GET(self):
        path = self.path.partition("?")[0]
        if path == "/stream.json":
            body = json.dumps(self.stream).encode()
            self.send_response(200)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)
        elif path in ("/", "/player.js", "/moq.js", "/mp4.js"):
            super().do_GET()
        else:
            self.send_error(404)

    def do_POST(self):
        self.take_log(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


@contextlib.contextmanager
def serve_page(stream, take_log):
    """Its address, as long as the page is served."""
    server = http.server.ThreadingHTTPServer((LOOPBACK, 0), functools.partial(Page, stream=stream, take_log=take_log))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://{LOOPBACK}:{server.server_port}/"
    finally:
        server.shutdown()


@contextlib.asynccontextmanager
async def running(what, *command, **more):
    """A process that ends when this does; its `what` is for messages."""
    process = await asyncio.create_subprocess_exec(*map(str, command), **more)
    process.what = what
    try:
        yield process
    finally:
        if process.returncode is None:
            process.send_signal(signal.SIGINT)
            try:
                await asyncio.wait_for(process.wait(), 10)
            except asyncio.TimeoutError:
                process.kill()
                await process.wait()


async def relay_sessions(relay):
    """Accepts whoever comes, on loopback, and fans out what one publishes to all others."""

    async def hold(request):
        with contextlib.suppress(moq.Error):  # says why a session has ended, which all do
            session = await request.accept()
            await session.closed()

    sessions = set()
    async for request in relay:
        sessions.add(task := asyncio.create_task(hold(request)))
        task.add_done_callback(sessions.discard)


async def ended(process):
    """Only of one that should not have."""
    raise SystemExit(f"stream: {process.what} has ended with {await process.wait()}")


def browser(profile, address):
    root = ["--no-sandbox"] if os.geteuid() == 0 else []  # which Chromium refuses to root
    return ["chromium", "--headless=new", *root, "--disable-gpu", "--no-first-run", "--disable-extensions",
            "--disable-background-networking", f"--user-data-dir={profile}", address]


async def until(task, processes):
    """The task's result; raises where a process ends before."""
    watchers = [asyncio.ensure_future(ended(process)) for process in processes]
    try:
        done, _ = await asyncio.wait([asyncio.ensure_future(task), *watchers], return_when=asyncio.FIRST_COMPLETED)
        return [each.result() for each in done][0]
    finally:
        for each in watchers:
            each.cancel()


async def stream(options, traces):
    """`traces`: files for the game's and the upscaler's, by their names; or none. The page's log, of --measure."""
    loop = asyncio.get_running_loop()
    log = loop.create_future()
    take_log = lambda taken: loop.call_soon_threadsafe(lambda: log.done() or log.set_result(taken))
    async with contextlib.AsyncExitStack() as stack:
        # An ECDSA certificate of its own, for 14 days, made now: what browsers ask of one that is known by its hash.
        relay = await stack.enter_async_context(moq.Server(f"{LOOPBACK}:0", tls_generate=["localhost"]))
        accepting = asyncio.create_task(relay_sessions(relay))
        stack.callback(accepting.cancel)
        certificate, address = relay.cert_fingerprints()[0], f"https://{relay.local_addr}"
        page = stack.enter_context(serve_page(
            {"relay": address, "certificate": certificate, "broadcast": NAME, "track": "video"}, take_log))

        # A folder of its own for sockets, so that a game of this name elsewhere is no other; Python with moq-rs first.
        runtime = stack.enter_context(tempfile.TemporaryDirectory(prefix="clarus-stream-"))
        environment = os.environ | {"XDG_RUNTIME_DIR": runtime,
                                    "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
        traced = lambda who: ["--trace", traces[who]] if traces else []
        start = functools.partial(running, env=environment, start_new_session=True)
        server = await stack.enter_async_context(start(
            "clarus serve", options.tool, "serve", NAME, "--model", options.model, "--device", options.device,
            "--output", f"moq:{address}/{NAME}#{certificate}", *traced("the upscaler"), stdout=asyncio.subprocess.PIPE))
        rendered = ["render", "--scene", options.scene, "--size", options.size, "--frames", 10**6, "--frame-step",
                    max(1, round(60 / options.frame_rate))]
        played = ["play", options.play, "--loop"]
        game = await stack.enter_async_context(start(
            "the game", options.tool, *(played if options.play else rendered), "--frame-rate", options.frame_rate,
            "--share", NAME, *traced("the game")))
        line = await until(server.stdout.readline(), [server, game])
        print(line.decode(), end="", flush=True)
        if not options.measure:
            print(f"Open {page} in Chromium. Ctrl-C ends it.", flush=True)
            return await until(asyncio.Event().wait(), [server, game])
        profile = stack.enter_context(tempfile.TemporaryDirectory(prefix="clarus-chromium-"))
        silent = asyncio.subprocess.DEVNULL
        chromium = await stack.enter_async_context(running(
            "chromium", *browser(profile, f"{page}?measure={options.measure + figures.SETTLING}"), stdout=silent, stderr=silent))
        return await until(asyncio.wait_for(log, options.measure + 60), [server, game, chromium])


def main():
    options = arguments()
    if options.measure and not shutil.which("chromium"):
        raise SystemExit("stream: --measure needs Debian's chromium")
    log = {"pictures": []}
    with tempfile.TemporaryDirectory(prefix="clarus-trace-") as folder:
        traces = {who: Path(folder) / f"{who}.json" for who in ("the game", "the upscaler")} if options.trace else {}
        try:
            log = asyncio.run(stream(options, traces)) or log
        except KeyboardInterrupt:
            pass
        except asyncio.TimeoutError:
            raise SystemExit("stream: the page has not shown enough in time")
        if traces:
            way = timeline.steps(timeline.write(options.trace, traces, log["pictures"]))
    if not options.measure or not log["pictures"]:
        return
    if options.log:
        options.log.write_text(json.dumps(log) + "\n")
    if log["failure"]:
        raise SystemExit(f"stream: the page cannot decode: {log['failure']}")
    measured = figures.of(log["pictures"])
    print(figures.text(measured))
    if options.trace:
        print("ms of a frame's way, medians: " + ", ".join(f"{name} {value:.1f}" for name, value in way.items()))
    sys.exit(not figures.goal(measured, options.frame_rate))


if __name__ == "__main__":
    main()
