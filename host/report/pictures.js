// Any two sources of one frame: side by side under a slider, or their difference.

const largestZoom = 32;
const heatStops = [[0, 0, 4], [66, 10, 104], [147, 38, 103], [221, 81, 58], [252, 165, 10], [252, 255, 164]];

function heatColor(share) {
  const place = Math.min(share, 1) * (heatStops.length - 1);
  const below = Math.min(Math.floor(place), heatStops.length - 2);
  return heatStops[below].map((value, c) => value + (heatStops[below + 1][c] - value) * (place - below));
}

function showPictures(report) {
  const {sources = [], pictured = [], frames = [], masks = []} = report;
  if (!sources.length) return;
  $('pictures').hidden = false;
  const [width, height] = report.output_size;
  const stage = $('stage'), canvas = $('canvas'), split = $('split');
  stage.style.setProperty('--aspect', width / height);

  // Not the first: what gathers its picture over time has nothing yet there. Of results that grow, the last.
  const opening = report.version ? pictured.length - 1 : pictured.length >> 1;
  const whole = {zoom: 1, x: width / 2, y: height / 2, place: null};
  const state = {left: 0, right: 0, frame: opening, split: 0.5, difference: false, mask: -1, ...whole};
  const results = sources.findLastIndex((source) => source.kind === 'result');
  state.left = Math.max(0, sources.findIndex((source) => source.kind === 'result'));
  state.right = results > state.left ? results : sources.length - 1;

  // Decoded when they are first shown.
  const decoded = new Map();
  function image({name, images}, frame) {
    if (!decoded.has(images)) decoded.set(images, []);
    const pictures = decoded.get(images);
    if (!pictures[frame]) {
      const picture = pictures[frame] = new Image();
      picture.src = images[frame];
      picture.decode().then(draw, () => {
        throw new Error(`cannot decode a picture of ${name}`);
      });
    }
    const picture = pictures[frame];
    return picture.complete && picture.naturalWidth ? picture : null;
  }

  // CSS pixels a picture's pixel.
  const scale = () => (stage.clientWidth / width) * state.zoom;

  function place(context, ratio) {
    const s = scale() * ratio;
    const clampCentre = (centre, extent, shown) => Math.min(Math.max(centre, shown / 2), extent - shown / 2);
    state.x = clampCentre(state.x, width, width / state.zoom);
    state.y = clampCentre(state.y, height, height / state.zoom);
    context.setTransform(s, 0, 0, s, canvas.width / 2 - state.x * s, canvas.height / 2 - state.y * s);
  }

  function paint(context, picture, ratio) {
    // Blocks where a pixel of the picture covers two of the screen or more, as in a small input.
    context.imageSmoothingEnabled = (scale() * ratio * width) / (picture.naturalWidth || picture.width) < 2;
    context.drawImage(picture, 0, 0, width, height);
  }

  let heat = {key: ''};
  function heatMap(left, right) {
    const gain = Number($('gain').value);
    const key = [state.left, state.right, state.frame, gain].join(' ');
    if (heat.key === key) return heat.canvas;
    const [a, b] = [left, right].map((picture) => {
      const context = new OffscreenCanvas(width, height).getContext('2d', {willReadFrequently: true});
      context.imageSmoothingEnabled = false;
      context.drawImage(picture, 0, 0, width, height);
      return context.getImageData(0, 0, width, height).data;
    });
    const table = Array.from({length: 256}, (_, level) => heatColor((level * gain) / 255));
    const pixels = new ImageData(width, height), out = pixels.data;
    for (let i = 0; i < out.length; i += 4) {
      const level = Math.max(Math.abs(a[i] - b[i]), Math.abs(a[i + 1] - b[i + 1]), Math.abs(a[i + 2] - b[i + 2]));
      [out[i], out[i + 1], out[i + 2]] = table[level];
      out[i + 3] = 255;
    }
    const map = new OffscreenCanvas(width, height);
    map.getContext('2d').putImageData(pixels, 0, 0);
    heat = {key, canvas: map};
    return map;
  }

  // A mask's pixels in a colour that lets the picture through.
  let layer = {key: ''};
  function maskLayer(picture) {
    const key = [state.mask, state.frame].join(' ');
    if (layer.key === key) return layer.canvas;
    const canvas = new OffscreenCanvas(width, height), context = canvas.getContext('2d', {willReadFrequently: true});
    context.drawImage(picture, 0, 0, width, height);
    const pixels = context.getImageData(0, 0, width, height), out = pixels.data;
    for (let i = 0; i < out.length; i += 4) out.set([255, 0, 160, out[i] > 127 ? 128 : 0], i);
    context.putImageData(pixels, 0, 0);
    layer = {key, canvas};
    return canvas;
  }

  // What lies over either side: a mask, the frame of a place.
  function drawLayers(context) {
    const mask = masks[state.mask] && image(masks[state.mask], state.frame);
    if (mask) {
      context.imageSmoothingEnabled = false;
      context.drawImage(maskLayer(mask), 0, 0);
    }
    if (state.place) {
      context.lineWidth = 2 / scale();
      context.strokeStyle = '#ffc800';
      context.strokeRect(state.place.x, state.place.y, report.block, report.block);
    }
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(stage.clientWidth * ratio);
    canvas.height = Math.round(stage.clientHeight * ratio);
    const left = image(sources[state.left], state.frame), right = image(sources[state.right], state.frame);
    if (!left || !right) return;
    const context = canvas.getContext('2d');
    place(context, ratio);
    if (state.difference) {
      paint(context, heatMap(left, right), ratio);
      drawLayers(context);
      return;
    }
    paint(context, right, ratio);
    context.save();
    context.resetTransform();
    context.beginPath();
    context.rect(0, 0, state.split * canvas.width, canvas.height);
    context.clip();
    place(context, ratio);
    paint(context, left, ratio);
    context.restore();
    drawLayers(context);
  }

  function quality(source) {
    const result = (report.results ?? []).find((one) => one.name === source.name && source.kind === 'result');
    const figures = result?.quality.frames[pictured[state.frame]];
    if (!figures) return source.name;
    return `${source.name} ${
        timeFigures.filter(({key}) => key in figures)
            .map(({key, heading, unit, decimals}) => `${heading} ${figures[key].toFixed(decimals)}${unit}`)
            .join(', ')}`;
  }

  // A hidden element loses the focus, and with it the keys go nowhere.
  function hideSplit() {
    const hadFocus = document.activeElement === split;
    split.hidden = state.difference;
    if (hadFocus && split.hidden) $('show-difference').focus({preventScroll: true});
  }

  function update() {
    const [left, right] = [sources[state.left], sources[state.right]];
    $('left').value = state.left;
    $('right').value = state.right;
    $('mask').value = state.mask;
    $('frame').value = state.frame;
    $('frame-name').textContent = frames[pictured[state.frame]];
    $('left-name').textContent = state.difference ? `${left.name} − ${right.name}` : left.name;
    $('right-name').textContent = right.name;
    $('right-name').hidden = state.difference;
    hideSplit();
    split.style.left = `${state.split * 100}%`;
    split.setAttribute('aria-valuenow', Math.round(state.split * 100));
    $('caption').replaceChildren(...[left, right].map((source) => html('span', {}, quality(source))));
    $('show-slider').setAttribute('aria-pressed', !state.difference);
    $('show-difference').setAttribute('aria-pressed', state.difference);
    $('gain-label').hidden = $('heat-legend').hidden = !state.difference;
    $('heat-most').textContent =
        `${Math.floor(255 / Number($('gain').value))} of 255 levels, the channel that differs most`;
    $('zoom-fit').textContent = `×${plain(state.zoom)}`;
    stage.classList.toggle('zoomed', state.zoom > 1);
    draw();
  }
  const change = (changes) => {
    Object.assign(state, changes);
    update();
  };

  function showFrame(index) {
    const frame = Math.min(Math.max(index, 0), pictured.length - 1);
    change({frame, place: null});
    report.frameShown?.(pictured[frame]);
  }
  // Other sections show the picture nearest to one of their frames, and stay at that frame.
  const nearest = (index) =>
      pictured.reduce((best, at, i) => (Math.abs(at - index) < Math.abs(pictured[best] - index) ? i : best), 0);
  report.showNearest = (index) => change({frame: nearest(index), place: null});

  // A result beside the reference: the whole picture, or a place in it.
  report.showResult = (name, index, place) => {
    const shown = {
      left: sources.findIndex((source) => source.kind === 'result' && source.name === name),
      right: sources.findIndex(({kind}) => kind === 'reference'),
      frame: nearest(index),
    };
    const middleOf = (from) => from + report.block / 2;
    const enlarged = place &&
        {zoom: Math.max(2, width / (4 * report.block)), x: middleOf(place.x), y: middleOf(place.y), place};
    change({...shown, ...whole, ...enlarged});
    report.frameShown?.(index);
    $('pictures').scrollIntoView();
  };

  // What is looked at, by names: a page that comes after may have other frames and sources. Who looks at the last frame
  // goes on doing so.
  report.picture = () => {
    const {left, right, frame, mask, ...rest} = state;
    return {
      ...rest,
      left: sources[left].name,
      right: sources[right].name,
      mask: masks[mask]?.name,
      frame: frame === pictured.length - 1 ? null : frames[pictured[frame]],
    };
  };
  report.returnTo = ({left, right, frame, mask, ...rest}) => {
    const sourceOf = (name, other) => {
      const found = sources.findIndex((source) => source.name === name);
      return found < 0 ? other : found;
    };
    const at = frames.indexOf(frame);
    change({
      ...rest,
      left: sourceOf(left, state.left),
      right: sourceOf(right, state.right),
      mask: masks.findIndex(({name}) => name === mask),
      frame: frame === null ? pictured.length - 1 : at < 0 ? state.frame : nearest(at),
    });
    report.frameShown?.(pictured[state.frame]);
  };

  // The point of the picture that is under a point of the stage stays there.
  function zoomTo(zoom, fromX = stage.clientWidth / 2, fromY = stage.clientHeight / 2) {
    const next = Math.min(Math.max(zoom, 1), largestZoom);
    const dx = fromX - stage.clientWidth / 2, dy = fromY - stage.clientHeight / 2, before = scale();
    const after = (before / state.zoom) * next;
    change({zoom: next, x: state.x + dx / before - dx / after, y: state.y + dy / before - dy / after});
  }
  const move = (dx, dy) => change({x: state.x - dx / scale(), y: state.y - dy / scale()});
  const splitTo = (share) => change({split: Math.min(Math.max(share, 0), 1)});
  // So much of what is shown, by its sides.
  const look = (right, down) => move(-right * stage.clientWidth, -down * stage.clientHeight);
  const swap = () => change({left: state.right, right: state.left});
  const reset = () => change(whole);

  fill($('left'), sources.map(({name}) => ({label: name})));
  fill($('right'), sources.map(({name}) => ({label: name})));
  fill($('mask'), masks.map(({name}) => ({label: name.replace('_', ' ')})));
  $('mask-label').hidden = !masks.length;
  $('frame').max = pictured.length - 1;
  document.querySelector('.scrub').hidden = pictured.length < 2;
  const gradient = Array.from({length: 11}, (_, i) => `rgb(${heatColor(i / 10).map(Math.round).join(' ')})`);
  document.querySelector('#heat-legend i').style.background = `linear-gradient(to right, ${gradient.join(', ')})`;

  $('encoding').textContent =
      report.lossless ? '' : 'The pictures are JPEGs of quality 95; figures are those of the images themselves.';

  $('left').addEventListener('change', (event) => change({left: Number(event.target.value)}));
  $('right').addEventListener('change', (event) => change({right: Number(event.target.value)}));
  $('frame').addEventListener('input', (event) => showFrame(Number(event.target.value)));
  $('gain').addEventListener('change', update);
  $('mask').addEventListener('change', (event) => change({mask: Number(event.target.value)}));
  $('swap').addEventListener('click', swap);
  $('show-slider').addEventListener('click', () => change({difference: false}));
  $('show-difference').addEventListener('click', () => change({difference: true}));
  $('zoom-in').addEventListener('click', () => zoomTo(state.zoom * 2));
  $('zoom-out').addEventListener('click', () => zoomTo(state.zoom / 2));
  $('zoom-fit').addEventListener('click', reset);

  split.addEventListener('keydown', (event) => {
    const steps = {
      ArrowLeft: -0.02,
      ArrowDown: -0.02,
      ArrowRight: 0.02,
      ArrowUp: 0.02,
      PageDown: -0.1,
      PageUp: 0.1,
      Home: -1,
      End: 1
    };
    if (event.shiftKey || !(event.key in steps)) return;
    event.preventDefault();
    splitTo(state.split + steps[event.key]);
  });
  $('pictures').addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows = {
      ArrowLeft: () => look(-0.1, 0),
      ArrowRight: () => look(0.1, 0),
      ArrowUp: () => look(0, -0.1),
      ArrowDown: () => look(0, 0.1)
    };
    const actions = {
      '[': () => showFrame(state.frame - 1),
      ']': () => showFrame(state.frame + 1),
      x: swap,
      d: () => {
        change({difference: !state.difference});
        if (!state.difference && event.target === $('show-difference')) split.focus({preventScroll: true});
      },
      0: reset,
      '+': () => zoomTo(state.zoom * 2),
      '=': () => zoomTo(state.zoom * 2),
      '-': () => zoomTo(state.zoom / 2),
    };
    const action = event.shiftKey && arrows[event.key] || actions[event.key.toLowerCase()];
    if (!action || event.target.tagName === 'SELECT') return;
    event.preventDefault();
    action();
  });

  // One pointer moves the slider or, in a zoomed picture, the picture; two pinch.
  const pointers = new Map();
  const at = (event) => {
    const box = stage.getBoundingClientRect();
    return {x: event.clientX - box.left, y: event.clientY - box.top};
  };
  let onSplit = false;
  stage.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    stage.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at(event));
    if (pointers.size > 1) return;
    onSplit = !state.difference && (event.target === split || state.zoom === 1);
    stage.classList.toggle('moving', !onSplit && state.zoom > 1);
    if (!onSplit) return;
    event.preventDefault();
    split.focus({preventScroll: true});
    splitTo(at(event).x / stage.clientWidth);
  });
  stage.addEventListener('pointermove', (event) => {
    const before = pointers.get(event.pointerId), now = at(event);
    if (!before) return;
    const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
    pointers.set(event.pointerId, now);
    if (other) {
      const apart = (point) => Math.hypot(point.x - other.x, point.y - other.y) || 1;
      zoomTo((state.zoom * apart(now)) / apart(before), (now.x + other.x) / 2, (now.y + other.y) / 2);
    } else if (onSplit) {
      splitTo(now.x / stage.clientWidth);
    } else {
      move(now.x - before.x, now.y - before.y);
    }
  });
  for (const end of ['pointerup', 'pointercancel']) {
    stage.addEventListener(end, (event) => {
      pointers.delete(event.pointerId);
      stage.classList.remove('moving');
    });
  }
  stage.addEventListener('wheel', (event) => {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    const {x, y} = at(event);
    zoomTo(state.zoom * 2 ** (-event.deltaY / 200), x, y);
  }, {passive: false});
  stage.addEventListener('dblclick', (event) => {
    const {x, y} = at(event);
    if (state.zoom > 1)
      reset();
    else
      zoomTo(4, x, y);
  });
  new ResizeObserver(draw).observe(stage);
  report.firstShown = pictured[opening];
  update();
}
