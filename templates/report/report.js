// Zoom, reading off, and the choice of run and model. Without it every figure stands on the page as it is.
"use strict";
(() => {
  const number = (value, span) => {
    const digits = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(span || 1))));
    return value.toFixed(digits).replace("-", "\u2212");
  };
  const ticks = (low, high) => {
    const raw = (high - low) / 6, size = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 2.5, 5, 10].map((m) => m * size).find((s) => s >= raw * 0.999999);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(+(k * step).toPrecision(10));
    return found;
  };
  const points = (shape) => (shape.tagName === "polyline"
    ? shape.getAttribute("points").trim().split(/\s+/).map((p) => p.split(",").map(Number))
    : [...shape.getAttribute("d").matchAll(/M(\S+) (\S+?)h0/g)].map((m) => [Number(m[1]), Number(m[2])]));

  const chart = (svg) => {
    const panels = [...svg.querySelectorAll("svg.panel")];
    if (!panels.length) return;
    const x0 = +svg.dataset.x0, x1 = +svg.dataset.x1, left = +panels[0].getAttribute("x"), width = +panels[0].getAttribute("width");
    let low = x0, high = x1, at = null, start = null;
    const read = document.createElement("div"), said = document.createElement("span"), reset = document.createElement("button");
    read.className = "read";
    said.setAttribute("aria-live", "polite");
    said.textContent = "drag or + to zoom, arrows to read off";
    reset.type = "button";
    reset.textContent = "whole";
    reset.hidden = true;
    read.append(said, reset);
    svg.after(read);
    const make = (name, cls, parent) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", name);
      made.setAttribute("class", cls);
      made.style.display = "none";
      parent.append(made);
      return made;
    };
    const cursors = panels.map((p) => make("line", "cursor", p)), zooms = panels.map((p) => make("rect", "zoom", p));
    const place = (x) => width * (x - x0) / (x1 - x0);
    const series = panels.map((p) => [...p.querySelectorAll("[data-name]")].map((s) => ({ name: s.dataset.name, xy: points(s) })));
    const draw = () => {
      panels.forEach((p) => p.setAttribute("viewBox", `${place(low)} 0 ${place(high) - place(low)} ${p.getAttribute("height")}`));
      const group = svg.querySelector("g.ticks");
      group.replaceChildren(...ticks(low, high).map((t) => {
        const text = document.createElementNS("http://www.w3.org/2000/svg", "text");
        text.setAttribute("x", left + width * (t - low) / (high - low));
        text.setAttribute("y", group.dataset.y);
        text.setAttribute("text-anchor", "middle");
        text.textContent = String(t).replace("-", "\u2212");
        return text;
      }));
      reset.hidden = low === x0 && high === x1;
    };
    const show = (x) => {
      at = Math.min(high, Math.max(low, x));
      const parts = [`${svg.dataset.x.split(",")[0]} ${number(at, high - low)}`];
      panels.forEach((p, i) => {
        const c = cursors[i], y0 = +p.dataset.y0, y1 = +p.dataset.y1, h = +p.getAttribute("height");
        c.style.display = "";
        for (const [k, v] of [["x1", place(at)], ["x2", place(at)], ["y1", 0], ["y2", h]]) c.setAttribute(k, v);
        for (const { name, xy } of series[i]) {
          if (!xy.length) continue;
          const near = xy.reduce((a, b) => (Math.abs(b[0] - place(at)) < Math.abs(a[0] - place(at)) ? b : a));
          parts.push(`${p.dataset.label.split(",")[0]} ${name === p.dataset.label.split(",")[0] ? "" : name} ${number(y1 - near[1] / h * (y1 - y0), y1 - y0)}`.replace(/ +/g, " "));
        }
      });
      said.textContent = [...new Set(parts)].join(" \u00b7 ");
    };
    const here = (event) => {
      const box = panels[0].querySelector(".ground").getBoundingClientRect(), all = svg.getBoundingClientRect();
      const scale = all.width / svg.viewBox.baseVal.width;
      return box.width ? low + (high - low) * Math.min(1, Math.max(0, (event.clientX - all.left - left * scale) / (width * scale))) : low;
    };
    const to = (a, b) => {
      if (b - a < (x1 - x0) / 500) return;
      low = Math.max(x0, a);
      high = Math.min(x1, b);
      draw();
    };
    const whole = () => { low = x0; high = x1; draw(); };
    svg.addEventListener("pointermove", (event) => {
      const x = here(event);
      show(x);
      if (start === null) return;
      panels.forEach((p, i) => {
        const [a, b] = [place(Math.min(start, x)), place(Math.max(start, x))];
        for (const [k, v] of [["x", a], ["width", b - a], ["y", 0], ["height", p.getAttribute("height")]]) zooms[i].setAttribute(k, v);
        zooms[i].style.display = "";
      });
    });
    svg.addEventListener("pointerdown", (event) => { if (event.pointerType !== "touch") { start = here(event); svg.setPointerCapture(event.pointerId); } else show(here(event)); });
    svg.addEventListener("pointerup", (event) => {
      const x = here(event);
      zooms.forEach((z) => { z.style.display = "none"; });
      if (start !== null && Math.abs(x - start) > (high - low) / 50) to(Math.min(start, x), Math.max(start, x));
      start = null;
    });
    svg.addEventListener("dblclick", whole);
    reset.addEventListener("click", () => { whole(); svg.focus(); });
    svg.addEventListener("keydown", (event) => {
      const middle = at === null ? (low + high) / 2 : at, span = high - low;
      if (event.key === "ArrowLeft" || event.key === "ArrowRight") show(middle + (event.key === "ArrowLeft" ? -1 : 1) * span / 100);
      else if (event.key === "+" || event.key === "=") to(middle - span / 4, middle + span / 4);
      else if (event.key === "-") to(middle - span, middle + span);
      else if (event.key === "Escape" || event.key === "0") whole();
      else return;
      event.preventDefault();
    });
  };
  document.querySelectorAll("svg.chart").forEach(chart);

  for (const picker of document.querySelectorAll(".picker")) {
    const pairs = [...document.querySelectorAll(`figure.pair[data-axis="${picker.dataset.axis}"]`)];
    if (pairs.length < 2) continue;
    const choose = (word, key) => {
      const label = document.createElement("label"), select = document.createElement("select");
      label.append(`${word} `, select);
      for (const value of new Set(pairs.map((p) => p.dataset[key]))) select.append(new Option(value, value));
      select.addEventListener("change", pick);
      picker.append(label);
      return select;
    };
    const pick = () => pairs.forEach((p) => { p.style.display = p.dataset.model === model.value && p.dataset.run === run.value ? "" : "none"; });
    const model = choose("model", "model"), run = choose("run", "run");
    picker.hidden = false;
    pick();
  }
})();
