import {subscribe} from './moq.js';
import {readFragment, readStart} from './mp4.js';

const canvas = document.querySelector('canvas');
const context = canvas.getContext('2d');
const status = document.querySelector('#status');

// Every picture: {number, made, arrived, shown, bytes}, times in milliseconds since 1970.
const log = [];
const kept = 600;  // of them, where nobody measures
const seconds = Number(new URLSearchParams(location.search).get('measure'));
let count = 0;
const underWay = new Map();  // by timestamp
const wall = (now) => performance.timeOrigin + now;
let startBytes = null, start = null, decoder = null, failure = '';

function show(picture) {
  if (canvas.width !== picture.displayWidth || canvas.height !== picture.displayHeight) {
    canvas.width = picture.displayWidth;
    canvas.height = picture.displayHeight;
  }
  context.drawImage(picture, 0, 0);
  const entry = underWay.get(picture.timestamp);
  underWay.delete(picture.timestamp);
  picture.close();
  if (!entry) return;
  log.push({...entry, shown: wall(performance.now())});
  ++count;
  if (!seconds && log.length > kept) log.shift();
}

const isSame = (bytes, others) => bytes.length === others?.length && bytes.every((byte, i) => byte === others[i]);

function begin(bytes) {
  if (decoder?.state === 'configured' && isSame(bytes, startBytes)) return;
  startBytes = bytes;
  start = readStart(bytes);
  if (decoder && decoder.state !== 'closed') decoder.close();
  underWay.clear();
  decoder = new VideoDecoder({
    output: show,
    error: (error) => {
      failure = String(error);
    }
  });
  decoder.configure(start.decoder);
}

function take(bytes, {index, arrived}) {
  if (index === 0) return begin(bytes);        // what a player begins with, before every key picture
  if (decoder.state !== 'configured') return;  // after an error, until the next key picture
  const {number, ticks, made, data} = readFragment(bytes);
  const timestamp = Math.round(ticks * 1e6 / start.timescale);
  underWay.set(timestamp, {number, made, arrived: wall(arrived), bytes: bytes.length});
  decoder.decode(new EncodedVideoChunk({type: index === 1 ? 'key' : 'delta', timestamp, data}));
}

function tell() {
  const last = log.slice(-60);
  if (last.length < 2) return;
  const rate = (last.length - 1) * 1000 / (last.at(-1).shown - last[0].shown);
  const latency = last.reduce((sum, each) => sum + each.shown - each.made, 0) / last.length;
  status.textContent = `${canvas.width}×${canvas.height}, ${rate.toFixed(1)} pictures a second, ` +
      `${latency.toFixed(0)} ms from the renderer's frame to the picture, ${count} in all`;
}

// For so many seconds after the first picture, then the log goes to the server: ?measure=60.
function measure() {
  const wait = setInterval(() => {
    if (!failure && (!log.length || wall(performance.now()) - log[0].shown < seconds * 1000)) return;
    clearInterval(wait);
    fetch('log', {method: 'POST', body: JSON.stringify({pictures: log, failure})});
  }, 50);
}

async function main() {
  const options = await (await fetch('stream.json')).json();
  if (seconds) measure();
  setInterval(tell, 500);
  for (;;) {  // a stream that has ended, or not begun, may come
    try {
      await subscribe(options, take);
    } catch (error) {
      if (!log.length) status.textContent = `no stream yet: ${error.message}`;
    }
    await new Promise((resolve) => setTimeout(resolve, 300));
  }
}

main();
