// A subscriber of moq-lite-04 over WebTransport: what a player needs of draft-lcurley-moq-lite, and no more.

const SUBSCRIBE = 2;  // of a stream in both directions: what it asks for
const GROUP = 0;      // of a stream in one direction: what it brings

const varint = (value) => {
  if (value < 0x40) return [value];
  if (value < 0x4000) return [0x40 | (value >> 8), value & 0xff];
  return [0x80 | (value >>> 24), (value >>> 16) & 0xff, (value >>> 8) & 0xff, value & 0xff];
};

const text = (value) => {
  const bytes = new TextEncoder().encode(value);
  return [...varint(bytes.length), ...bytes];
};

const subscribeMessage = (broadcast, track) => {
  const priority = 128, ordered = 0, milliseconds = 0, fromGroup = 0, toGroup = 0;  // zeros: from the newest group on
  const id = varint(0), fields = [ordered, ...varint(milliseconds), ...varint(fromGroup), ...varint(toGroup)];
  const body = [...id, ...text(broadcast), ...text(track), priority, ...fields];
  return new Uint8Array([SUBSCRIBE, ...varint(body.length), ...body]);
};

// Reads so many bytes, or numbers, of a stream.
class Reader {
  constructor(stream) {
    this.reader = stream.getReader();
    this.bytes = new Uint8Array(0);
  }

  // False where the stream ends before.
  async has(count) {
    while (this.bytes.length < count) {
      const {done, value} = await this.reader.read();
      if (done) return false;
      const joined = new Uint8Array(this.bytes.length + value.length);
      joined.set(this.bytes);
      joined.set(value, this.bytes.length);
      this.bytes = joined;
    }
    return true;
  }

  async take(count) {
    if (!await this.has(count)) throw new Error('a stream ended in the middle of a message');
    const taken = this.bytes.slice(0, count);
    this.bytes = this.bytes.subarray(count);
    return taken;
  }

  async number() {
    const [first] = await this.take(1);
    const rest = await this.take((1 << (first >> 6)) - 1);
    return rest.reduce((value, byte) => value * 256 + byte, first & 0x3f);
  }
}

// Groups come on streams of their own, several at a time. They are handed on one after the other, each of their parts
// as soon as it is there.
class Order {
  constructor(onPart) {
    this.onPart = onPart;
    this.groups = new Map();
    this.newest = -1;  // that was begun
  }

  begin(sequence) {
    if (sequence <= this.newest && !this.groups.has(sequence)) return;
    this.groups.set(sequence, {parts: [], handed: 0, ended: false});
  }

  add(sequence, bytes) {
    this.groups.get(sequence)?.parts.push({bytes, arrived: performance.now()});
    this.handOn();
  }

  end(sequence) {
    const group = this.groups.get(sequence);
    if (group) group.ended = true;
    this.handOn();
  }

  handOn() {
    for (;;) {
      const sequence = Math.min(...this.groups.keys());
      const group = this.groups.get(sequence);
      if (!group) return;
      this.newest = Math.max(this.newest, sequence);
      for (; group.handed < group.parts.length; ++group.handed) {
        const {bytes, arrived} = group.parts[group.handed];
        group.parts[group.handed] = null;
        this.onPart(bytes, {group: sequence, index: group.handed, arrived});
      }
      if (!group.ended) return;
      this.groups.delete(sequence);
    }
  }
}

async function readGroup(stream, order) {
  const reader = new Reader(stream);
  const [type] = await reader.take(1);
  if (type !== GROUP) return;
  await reader.number();  // the message's length
  await reader.number();  // the subscription, of which there is one
  const sequence = await reader.number();
  order.begin(sequence);
  try {
    while (await reader.has(1)) order.add(sequence, await reader.take(await reader.number()));
  } finally {
    order.end(sequence);
  }
}

// Until the relay ends the track: calls onPart(bytes, {group, index, arrived}) for every part, in order. `certificate`:
// the SHA-256 of the relay's, in hexadecimal. Throws where there is no relay, or no such broadcast.
export async function subscribe({relay, certificate, broadcast, track}, onPart) {
  const value = new Uint8Array(certificate.match(/../g).map((byte) => parseInt(byte, 16)));
  const transport =
      new WebTransport(relay, {serverCertificateHashes: [{algorithm: 'sha-256', value}], protocols: ['moq-lite-04']});
  await transport.ready;
  try {
    const request = await transport.createBidirectionalStream();
    await request.writable.getWriter().write(subscribeMessage(broadcast, track));
    const order = new Order(onPart);
    const groups = (async () => {
      const streams = transport.incomingUnidirectionalStreams.getReader();
      for (;;) {
        const {done, value: stream} = await streams.read();
        if (done) return;
        readGroup(stream, order).catch(() => {});  // a group that the relay gives up
      }
    })();
    const answers = request.readable.getReader();  // ends with the track
    const ended = (async () => {
      while (!(await answers.read()).done) continue;
    })();
    await Promise.race([ended, groups]);
  } finally {
    transport.close();
  }
}
