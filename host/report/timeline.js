// When each device or process did what, frame after frame, and what a frame waits for.

// Of devices: what measure/timeline.h describes, as the lanes and spans that traces have.
function timelineOfDevices({label, devices, placement, stages, timeline}) {
  const lanes = devices.map(({selector}, index) => `${index}: ${selector}`);
  if (timeline.some(({stage}) => stages[stage].device < 0)) lanes.push('transfers');
  const spans = timeline.map(({stage, frame, start, end}) => {
    const {name, device} = stages[stage];
    return {name, frame, label: frame, lane: device < 0 ? lanes.length - 1 : device, start, end};
  });
  // Of a value that a part reads of the frame before: what made it, and what waits for it.
  const links = (placement ??
                 []).flatMap((part) => part.inputs.filter(({frames_ago}) => frames_ago > 0).map(({value}) => ({
                                                                                                  value,
                                                                                                  reader: part.stages[0]
                                                                                                })));
  return {label, lanes, spans, links};
}

// Everything that has a timeline: {label, lanes, spans, links}.
function timelinesOf(report) {
  const runs = (report.results ?? []).map(({name, run}) => ({...run, label: name}));
  const placements =
      (report.placements ?? []).map((placement) => ({
                                      ...placement,
                                      label: `${placement.name}, ${milliseconds(placement.seconds)} ms a frame`
                                    }));
  const traces = (report.traces ?? []).map((trace) => ({...trace, links: []}));
  return [...[...runs, ...placements].filter(({timeline}) => timeline?.length).map(timelineOfDevices), ...traces];
}

function showTimeline(report) {
  const timelines = timelinesOf(report);
  if (!timelines.length) return;
  $('timeline').hidden = false;
  fill($('timeline-of'), timelines);
  const chosen = () => timelines[$('timeline-of').value];
  let spans = [], current = 0;

  function choose() {
    spans = chosen().spans;
    const waits = chosen().links.map(({value, reader}) => `${reader} waits for ${value} of the frame before`);
    $('timeline-note').textContent = [
      'A colour is a frame. ← → go through the stages.',
      waits.length && `Lines: ${waits.join(', ')}; so long no device can begin the next frame.`
    ].filter(Boolean).join(' ');
    select(0);
  }
  function select(index) {
    current = (index + spans.length) % spans.length;
    const {name, frame, label: title, start, end} = spans[current];
    $('timeline-readout')
        .replaceChildren(
            html('span', {}, swatch(seriesColor(frame)), name), html('span', {class: 'muted'}, `frame ${title}`),
            html('span', {}, `${milliseconds(end - start)} ms from ${milliseconds(start)} ms on`));
    redraw();
  }
  const redraw = chart($('timeline-chart'), (width) => {
    const {lanes, links} = chosen();
    const lane = 34, left = 12 + 7 * Math.max(9, ...lanes.map((name) => name.length)), right = width - 12, top = 8,
          bottom = top + lanes.length * lane;
    const latest = Math.max(...spans.map(({end}) => end)) || 1;
    const x = linear(0, latest, left, right);
    const y = (index) => top + index * lane;
    const children = [];
    const {values} = ticks(0, latest * 1e3, Math.max(2, width / 120));
    for (const value of values) {
      children.push(
          vertical(x(value * 1e-3), top, bottom, 'grid'), label(x(value * 1e-3), bottom + 18, plain(value), 'middle'));
    }
    children.push(label(right, bottom + 34, 'ms', 'end'));
    lanes.forEach((name, index) => children.push(label(left - 8, y(index) + lane / 2 + 4, name, 'end')));
    spans.forEach(
        ({lane: row, frame, start, end, name}, index) => children.push(
            svg('rect', {
              x: x(start),
              y: y(row) + 4,
              width: Math.max(0.5, x(end) - x(start)),
              height: lane - 8,
              class: index === current ? 'ring' : undefined,
              style: `fill: ${seriesColor(frame)}`
            },
                svg('title', {}, name))));
    for (const {value, reader} of links) {
      for (const made of spans.filter(({name}) => name === value)) {
        const waiting = spans.find(({name, frame}) => name === reader && frame === made.frame + 1);
        if (waiting)
          children.push(
              path([[x(made.end), y(made.lane) + lane / 2], [x(waiting.start), y(waiting.lane) + lane / 2]], 'roof'));
      }
    }
    return {
      height: bottom + 40,
      attributes: {role: 'img', tabindex: 0, 'aria-label': 'When each device did what'},
      children,
      listeners: browsing({
        nearest: (atX, atY) => {
          const distance = ({lane: row, start, end}) =>
              Math.abs(y(row) + lane / 2 - atY) * 4 + Math.max(0, x(start) - atX, atX - x(end));
          return spans.reduce((best, span, index) => (distance(span) < distance(spans[best]) ? index : best), 0);
        },
        current,
        count: spans.length,
        go: select
      })
    };
  });
  $('timeline-of').addEventListener('change', choose);
  choose();
}
