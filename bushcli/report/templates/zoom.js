"use strict";
// Makes every plot of the page zoomable: wheel or pinch about the pointer, drag to move, double click for all,
// + - 0 and arrows on the keyboard, a click on a numbered place to zoom to it, on a name to hide its curve.
for (const figure of document.querySelectorAll("figure.plot")) {
  const frame = figure.querySelector("svg.frame"), pane = figure.querySelector("svg.pane");
  figure.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button?.dataset.key) return;
    const pressed = button.getAttribute("aria-pressed") === "true";
    button.setAttribute("aria-pressed", String(!pressed));
    for (const drawn of pane.querySelectorAll(`.${button.dataset.key}`)) drawn.style.display = pressed ? "none" : "";
  });
  if (figure.classList.contains("still")) continue;
  const grid = figure.querySelector(".grid"), readout = figure.querySelector(".readout");
  const [left, top, width, height] = ["x", "y", "width", "height"].map((name) => pane[name].baseVal.value);
  // On a logarithmic axis these are powers of ten.
  const [x0, x1] = frame.dataset.x.split(" ").map(Number), [y0, y1] = frame.dataset.y.split(" ").map(Number);
  const all = { x: 0, y: 0, w: width, h: height };
  let view = { ...all };
  const toX = (px) => x0 + (px / width) * (x1 - x0), toY = (py) => y1 - (py / height) * (y1 - y0);

  const shown = (value, axis) =>
    String(+(frame.dataset.log === axis ? 10 ** value : value).toPrecision(6)).replace("-", "\u2212");
  function ticks(low, high, most, axis) {
    const found = [];
    if (frame.dataset.log === axis) {
      const factors = high - low < Math.log10(50) ? [1, 2, 5] : [1];
      for (let power = Math.floor(low); power <= Math.ceil(high); power++)
        found.push(...factors.map((factor) => power + Math.log10(factor)).filter((at) => at >= low && at <= high));
      return found.length > 1 ? found : steps(10 ** low, 10 ** high, most).map(Math.log10);
    }
    return steps(low, high, most);
  }
  function steps(low, high, most) {
    const raw = (high - low) / most, power = 10 ** Math.floor(Math.log10(raw)), factors = [0.5, 1, 2, 5, 10];
    let chosen = factors.findIndex((factor) => factor >= 1 && power * factor >= raw * (1 - 1e-9)), found = [];
    // One number alone gives no scale: the steps are then finer.
    for (; found.length < 2 && chosen >= 0; chosen--) {
      const step = power * factors[chosen];
      found = [];
      for (let i = Math.ceil(low / step - 1e-9); i <= Math.floor(high / step + 1e-9); i++) found.push(i * step);
    }
    return found;
  }
  function element(name, attributes, text) {
    const made = document.createElementNS(frame.namespaceURI, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    grid.append(made);
  }
  function draw() {
    pane.setAttribute("viewBox", `${view.x} ${view.y} ${view.w} ${view.h}`);
    grid.replaceChildren();
    for (const value of ticks(toX(view.x), toX(view.x + view.w), Math.round(frame.viewBox.baseVal.width / 75), "x")) {
      const x = left + ((((value - x0) / (x1 - x0)) * width - view.x) / view.w) * width;
      element("line", { x1: x, x2: x, y1: top, y2: top + height, class: value || frame.dataset.log === "x" ? "" : "zero" });
      element("text", { x, y: top + height + 17, class: "x" }, shown(value, "x"));
    }
    for (const value of ticks(toY(view.y + view.h), toY(view.y), Math.max(4, Math.round(height / 40)), "y")) {
      const y = top + ((((y1 - value) / (y1 - y0)) * height - view.y) / view.h) * height;
      element("line", { x1: left, x2: left + width, y1: y, y2: y, class: value || frame.dataset.log === "y" ? "" : "zero" });
      element("text", { x: left - 7, y: y + 4, class: "y" }, shown(value, "y"));
    }
    for (const mark of figure.querySelectorAll(".mark")) {
      const x = ((mark.dataset.x - view.x) / view.w) * width, y = ((mark.dataset.y - view.y) / view.h) * height;
      mark.setAttribute("transform", `translate(${left + x} ${top + y})`);
      mark.style.display = x < 0 || x > width || y < 0 || y > height ? "none" : "";
    }
  }
  function zoom(factor, px = view.x + view.w / 2, py = view.y + view.h / 2, alongY = true) {
    const w = Math.min(Math.max(view.w * factor, width / 200), 4 * width);
    const h = alongY ? Math.min(Math.max(view.h * factor, height / 200), 4 * height) : view.h;
    view = { x: px - ((px - view.x) * w) / view.w, y: py - ((py - view.y) * h) / view.h, w, h };
    draw();
  }
  function move(dx, dy) {
    view = { ...view, x: view.x + dx, y: view.y + dy };
    draw();
  }
  function at(event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(frame.getScreenCTM().inverse());
    const fx = (point.x - left) / width, fy = (point.y - top) / height;
    return { x: view.x + fx * view.w, y: view.y + fy * view.h, inside: fx >= 0 && fx <= 1 && fy >= 0 && fy <= 1 };
  }
  function show(number) {
    const box = figure.querySelector(`.region[data-number="${number}"]`).getBBox();
    const w = Math.max(box.width * 1.3, width / 100), h = Math.max(box.height * 1.3, height / 100);
    view = { x: box.x + (box.width - w) / 2, y: box.y + (box.height - h) / 2, w, h };
    draw();
  }
  const reset = () => { view = { ...all }; draw(); };

  frame.addEventListener("wheel", (event) => {
    const place = at(event);
    // The wheel scrolls the page unless the plot was selected by a click or Ctrl is held.
    if (!place.inside || !(event.ctrlKey || document.activeElement === frame)) return;
    event.preventDefault();
    zoom(1.0015 ** event.deltaY, place.x, place.y, !event.shiftKey);
  }, { passive: false });
  const pointers = new Map();
  frame.addEventListener("pointerdown", (event) => {
    if (!at(event).inside) return;
    frame.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at(event));
  });
  frame.addEventListener("pointermove", (event) => {
    const place = at(event);
    readout.textContent = place.inside ? `${shown(+toX(place.x).toPrecision(4), "x")}, ${shown(+toY(place.y).toPrecision(4), "y")}` : "";
    const before = pointers.get(event.pointerId);
    if (!before) return;
    if (pointers.size === 2) {
      const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, value]) => value);
      const distance = (one) => Math.hypot(one.x - other.x, one.y - other.y);
      zoom(distance(before) / Math.max(distance(place), 1e-6), other.x, other.y);
    } else move(before.x - place.x, before.y - place.y);
    pointers.set(event.pointerId, at(event));
  });
  for (const name of ["pointerup", "pointercancel"]) frame.addEventListener(name, (event) => pointers.delete(event.pointerId));
  frame.addEventListener("pointerleave", () => { readout.textContent = ""; });
  frame.addEventListener("dblclick", reset);
  frame.addEventListener("keydown", (event) => {
    const step = 0.1, acts = {
      "+": () => zoom(0.7), "-": () => zoom(1 / 0.7), "0": reset, "Escape": () => frame.blur(),
      ArrowLeft: () => move(-step * view.w, 0), ArrowRight: () => move(step * view.w, 0),
      ArrowUp: () => move(0, -step * view.h), ArrowDown: () => move(0, step * view.h),
    };
    if (!(event.key in acts)) return;
    event.preventDefault();
    acts[event.key]();
  });
  figure.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (button?.dataset.zoom) ({ in: () => zoom(0.6), out: () => zoom(1 / 0.6), all: reset })[button.dataset.zoom]();
    if (button?.dataset.number) show(button.dataset.number);
  });
  figure.classList.add("zoomable");
}
