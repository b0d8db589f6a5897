"use strict";

{
  const data = JSON.parse(document.getElementById("data").textContent);

  function add(parent, tag, text = "", attributes = {}) {
    const element = document.createElement(tag);
    element.textContent = text;
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    parent.append(element);
    return element;
  }

  function addSvg(parent, tag, attributes, text = "") {
    const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.textContent = text;
    parent.append(element);
    return element;
  }

  document.title = document.getElementById("title").textContent = `Check of ${data.title}`;
  const wrong = data.findings.filter(({verdict}) => verdict === "wrong").map(({field}) => field);
  document.getElementById("subtitle").textContent =
    wrong.length ? `Surely wrong: ${wrong.join(", ")}` : "Nothing is surely wrong";

  const table = document.getElementById("findings");
  const head = add(table, "tr");
  for (const name of ["field", "declared", "fits best", "dB", "", "frames", ""]) add(head, "th", name);
  for (const {field, declared, best, gain, verdict, frames, note} of data.findings) {
    const row = add(table, "tr");
    const cells = [field, declared, best, gain > 0 ? gain.toFixed(1) : "–", verdict, frames, note];
    cells.forEach((text, i) => add(row, "td", text, i === 4 ? {class: verdict === "wrong" ? "wrong" : ""} : {}));
  }

  const warps = document.getElementById("warps");
  if (!data.pictures.length) add(warps, "p", "No frame has enough structure, or follows another.");
  for (const picture of data.pictures) {
    add(warps, "h3", `Frame ${picture.name}`);
    const row = add(warps, "div", "", {class: "frames"});
    const show = (source, caption) => {
      const figure = add(row, "figure");
      add(figure, "img", "", {src: source, alt: caption});
      add(figure, "figcaption", caption);
    };
    show(picture.present, "the frame itself");
    show(picture.declared, "the one before, by what is declared");
    show(picture.best, "the one before, by what fits best");
    if (picture.vectors) show(picture.vectors, `where surfaces come from; the legend's rim is ${picture.longest.toFixed(1)} pixels`);
  }
  if (data.legend) add(warps, "img", "", {src: data.legend, alt: "Colours of directions, from the middle", width: 96});

  const reach = 1, side = 220;
  const place = value => side / 2 + value / reach * side * 0.45;
  if (data.jitter.length) document.getElementById("jitter").hidden = false;
  for (const axis of data.jitter.length ? [0, 1] : []) {
    const figure = add(document.getElementById("plots"), "figure");
    const plot = addSvg(figure, "svg", {viewBox: `0 0 ${side} ${side}`, role: "img", width: side,
                                        "aria-label": `Jitter, ${"xy"[axis]}`});
    for (const sign of [1, -1])
      addSvg(plot, "line", {x1: place(-reach), y1: place(sign * reach), x2: place(reach), y2: place(-sign * reach),
                            stroke: "var(--line)"});
    for (const {name, declared, measured} of data.jitter) {
      const point = addSvg(plot, "circle", {cx: place(declared[axis]), cy: place(-measured[axis]), r: 3.5,
                                            fill: "var(--series-0)"});
      addSvg(point, "title", {}, `frame ${name}: ${declared[axis].toFixed(2)}, measured ${measured[axis].toFixed(2)}`);
    }
    add(figure, "figcaption", `${"xy"[axis]}: across, the JSON's; upwards, measured; to ±${reach}`);
  }
}
