// What a player needs of fragmented MP4 (ISO/IEC 14496-12) with one track and a picture a fragment.

const name = (bytes, at) => String.fromCharCode(...bytes.subarray(at, at + 4));
const viewOf = (bytes) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

// The content of boxes, by name: of several of one name the last.
function boxes(bytes, at = 0) {
  const found = {};
  for (const view = viewOf(bytes); at + 8 <= bytes.length;) {
    const size = view.getUint32(at);
    if (size < 8 || at + size > bytes.length) throw new Error('a box goes beyond its end');
    found[name(bytes, at + 4)] = bytes.subarray(at + 8, at + size);
    at += size;
  }
  return found;
}

const inside = (bytes, path) => path.reduce((content, box) => boxes(content)[box], bytes);

// What VideoDecoder.configure takes, and the track's ticks a second.
export function readStart(bytes) {
  const media = inside(bytes, ['moov', 'trak', 'mdia']);
  const header = boxes(media).mdhd;
  const entry = boxes(inside(media, ['minf', 'stbl', 'stsd']), 8).avc1;
  const description = boxes(entry, 78).avcC;
  const hex = [...description.subarray(1, 4)].map((byte) => byte.toString(16).padStart(2, '0')).join('');
  const size = viewOf(entry);
  return {
    timescale: viewOf(header).getUint32(header[0] === 1 ? 20 : 12),
    decoder: {
      codec: `avc1.${hex}`,
      codedWidth: size.getUint16(24),
      codedHeight: size.getUint16(26),
      description,
      optimizeForLatency: true,
    },
  };
}

// A picture: its number from 1, its time in the track's ticks, when it was begun, in milliseconds since 1970, and its
// bytes.
export function readFragment(bytes) {
  const {moof, mdat, prft} = boxes(bytes);
  const time = boxes(boxes(moof).traf).tfdt;
  const epoch = 2208988800;  // NTP counts seconds from 1900
  const clock = prft && viewOf(prft);
  return {
    number: viewOf(boxes(moof).mfhd).getUint32(4),
    ticks: time[0] === 1 ? Number(viewOf(time).getBigUint64(4)) : viewOf(time).getUint32(4),
    made: clock ? (clock.getUint32(8) - epoch + clock.getUint32(12) / 2 ** 32) * 1000 : null,
    data: mdat,
  };
}
