// What every section draws with: elements, scales, axes, words for numbers.

const $ = (id) => document.getElementById(id);

function build(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== undefined && value !== null && value !== false) node.setAttribute(name, value === true ? '' : value);
  }
  node.append(...children.filter((child) => child !== undefined && child !== null));
  return node;
}
const html = (tag, attributes = {}, ...children) => build(document.createElement(tag), attributes, children);
const svg = (tag, attributes = {}, ...children) =>
    build(document.createElementNS('http://www.w3.org/2000/svg', tag), attributes, children);

// A select's options; each has a label, maybe a group.
function fill(select, options) {
  const groups = new Map();
  options.forEach(({label, group}, index) => {
    if (group && !groups.has(group)) groups.set(group, html('optgroup', {label: group}));
    const option = html('option', {value: index}, label);
    if (group)
      groups.get(group).append(option);
    else
      select.append(option);
  });
  select.append(...groups.values());
}

// Devices that worked together.
const deviceNames = ({devices}) => devices.map(({name}) => name).join(' and ');

const seriesColor = (index) => `var(--series-${index % 8})`;
const swatch = (color) => html('span', {class: 'swatch', style: `--color: ${color}`});

// Three digits that count, never in powers of ten.
function digits(value) {
  if (!(value > 0)) return value === 0 ? '0' : '–';
  if (value < 0.001) return value.toPrecision(2);
  return value.toFixed(value < 0.1 ? 4 : value < 1 ? 3 : value < 10 ? 2 : value < 100 ? 1 : 0);
}
// Without zeros that say nothing, for axes.
const plain = (value) => String(Number(value.toPrecision(3)));
const milliseconds = (seconds) => digits(seconds * 1e3);
const gigas = (rate) => digits(rate * 1e-9);
const percent = (share) => `${(share * 100).toFixed(share < 0.0995 ? 1 : 0)} %`;
const mebibytes = (bytes) => `${digits(bytes / 1048576)} MiB`;
const sizeText = ([width, height]) => `${width}×${height}`;

// Round values that divide a range, at most so many.
function ticks(low, high, most) {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= rough) * power;
  const values = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; ++i) values.push(i * step);
  return {values, decimals: Math.max(0, -Math.floor(Math.log10(step) + 1e-9))};
}

// Powers of ten; with the values between them where there are few.
function logTicks(low, high) {
  const values = [];
  if (!(low > 0 && high < Infinity)) return values;
  for (let power = Math.floor(Math.log10(low)); 10 ** power <= high; ++power) {
    for (const factor of high / low < 500 ? [1, 2, 5] : [1]) {
      const value = factor * 10 ** power;
      if (value >= low * 0.999 && value <= high * 1.001) values.push(value);
    }
  }
  return values;
}

const linear = (low, high, from, to) => (value) => from + ((value - low) / (high - low)) * (to - from);
const logarithmic = (low, high, from, to) => {
  const scale = linear(Math.log(low), Math.log(high), from, to);
  return (value) => scale(Math.log(value));
};

// Draws now, and again when the width changes. `draw` takes the width and gives an <svg>'s attributes and children.
function chart(container, draw) {
  let width = 0;
  const redraw = () => {
    const hadFocus = container.contains(document.activeElement);
    const {height, attributes = {}, children, listeners = {}} = draw(width);
    const picture = svg('svg', {viewBox: `0 0 ${width} ${height}`, height, ...attributes}, ...children);
    for (const [event, listener] of Object.entries(listeners)) picture.addEventListener(event, listener);
    container.replaceChildren(picture);
    if (hadFocus) picture.focus({preventScroll: true});
  };
  new ResizeObserver(() => {
    if (container.clientWidth === 0 || container.clientWidth === width) return;
    width = container.clientWidth;
    redraw();
  }).observe(container);
  return () => {
    if (width) redraw();
  };
}

// Listeners of a chart that is gone through by mouse, finger and arrow keys: `nearest` to a place in it, `go` to an
// index, of `count`; `pick` what is clicked. A finger's tap is a click alone.
function browsing({nearest, current, count, go, pick}) {
  const under = (event) => {
    const box = event.currentTarget.getBoundingClientRect();
    return nearest(event.clientX - box.left, event.clientY - box.top);
  };
  const goTo = (index) => {
    if (index !== current) go(index);
  };
  return {
    pointermove: (event) => goTo(under(event)),
    click: (event) => {
      const index = under(event);
      goTo(index);
      pick?.(index);
    },
    keydown: (event) => {
      const places = {ArrowLeft: current - 1, ArrowRight: current + 1, Home: 0, End: count - 1};
      if (!(event.key in places)) return;
      event.preventDefault();
      go(places[event.key]);
    },
  };
}

const horizontal = (y, from, to, kind) => svg('line', {x1: from, x2: to, y1: y, y2: y, class: kind});
const vertical = (x, from, to, kind) => svg('line', {x1: x, x2: x, y1: from, y2: to, class: kind});
const label = (x, y, text, anchor = 'start', kind) => svg('text', {x, y, 'text-anchor': anchor, class: kind}, text);
const path = (points, kind, style) =>
    svg('path', {d: `M${points.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join('L')}`, class: kind, style});
