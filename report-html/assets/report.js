"use strict";
(() => {
  // Okabe and Ito: told apart by colour-blind readers too.
  const palettes = {
    light: ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#333333"],
    // The same hues, light enough for a dark page.
    dark: ["#56a8e0", "#f08a4b", "#2fc79b", "#e3a0c5", "#f0b93a", "#8fd0f5", "#d5dbe1"],
  };
  const dark = matchMedia("screen and (prefers-color-scheme: dark)");
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const { arrays, plots } = JSON.parse(document.getElementById("data").textContent);
  const decoded = new Map();
  const numbers = (at) => {
    if (!decoded.has(at)) {
      const [origin, text] = arrays[at];
      const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
      decoded.set(at, Array.from(new Float32Array(bytes.buffer), (v) => (Number.isFinite(v) ? origin + v : null)));
    }
    return decoded.get(at);
  };
  // Six digits, or as many as tell values apart that differ by `step`.
  const show = (v, step = 0) => {
    if (v == null) return "–";
    const size = Math.abs(v);
    if (step > 0 && size / step >= 1e5) return v.toFixed(Math.min(9, Math.max(0, -Math.floor(Math.log10(step)))));
    return size !== 0 && (size < 1e-3 || size >= 1e6) ? v.toExponential(3) : String(+v.toPrecision(6));
  };
  const loose = (s) => s.style === "dots" || s.style === "curve";

  // Series as uPlot wants them: every x once, increasing. Loose series are sorted for scale and hover only;
  // a hook draws them in their own order.
  const aligned = (spec) => {
    const tables = spec.series.map((s) => {
      const x = numbers(s.x), y = numbers(s.y);
      if (!loose(s)) return [x, y];
      const order = x.map((_, i) => i).filter((i) => x[i] !== null).sort((a, b) => x[a] - x[b]);
      const kept = order.filter((i, k) => k === 0 || x[i] !== x[order[k - 1]]);
      return [kept.map((i) => x[i]), kept.map((i) => y[i])];
    });
    const same = tables.every((t) => t[0] === tables[0][0]);
    return same ? [tables[0][0], ...tables.map((t) => t[1])] : uPlot.join(tables);
  };
  const extent = (list) => {
    let low = Infinity, high = -Infinity;
    for (const v of list) if (v !== null && v !== undefined) { if (v < low) low = v; if (v > high) high = v; }
    return [low, high];
  };

  const draw = (element, spec) => {
    const palette = palettes[dark.matches ? "dark" : "light"];
    const colour = (s, i) => palette[(s.colour ?? i) % palette.length];
    const yAll = extent(spec.series.flatMap((s) => extent(numbers(s.y))).concat(spec.markers.filter((m) => "y" in m).map((m) => m.y)));
    const drawLoose = (u) => {
      const { ctx } = u;
      const ratio = devicePixelRatio || 1;
      ctx.save();
      ctx.beginPath();
      ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
      ctx.clip();
      spec.series.forEach((s, i) => {
        if (!loose(s) || !u.series[i + 1].show) return;
        const x = numbers(s.x), y = numbers(s.y);
        ctx.strokeStyle = ctx.fillStyle = colour(s, i);
        ctx.lineWidth = 1.5 * ratio;
        ctx.setLineDash(s.dashed ? [6 * ratio, 4 * ratio] : []);
        ctx.beginPath();
        let pen = false;
        const radius = (x.length > 500 ? 1.2 : 2.2) * ratio;
        for (let k = 0; k < x.length; k++) {
          if (x[k] === null || y[k] === null) { pen = false; continue; }
          const px = u.valToPos(x[k], "x", true), py = u.valToPos(y[k], "y", true);
          if (s.style === "dots") { ctx.rect(px - radius, py - radius, 2 * radius, 2 * radius); }
          else if (pen) ctx.lineTo(px, py);
          else { ctx.moveTo(px, py); pen = true; }
        }
        if (s.style === "dots") { ctx.globalAlpha = x.length > 500 ? 0.45 : 0.9; ctx.fill(); ctx.globalAlpha = 1; }
        else ctx.stroke();
      });
      ctx.setLineDash([4 * ratio, 4 * ratio]);
      ctx.strokeStyle = "#8c959f";
      ctx.lineWidth = ratio;
      for (const m of spec.markers) {
        ctx.beginPath();
        if ("x" in m) { const at = u.valToPos(m.x, "x", true); ctx.moveTo(at, u.bbox.top); ctx.lineTo(at, u.bbox.top + u.bbox.height); }
        else { const at = u.valToPos(m.y, "y", true); ctx.moveTo(u.bbox.left, at); ctx.lineTo(u.bbox.left + u.bbox.width, at); }
        ctx.stroke();
      }
      ctx.restore();
    };
    const axis = { stroke: style("--soft"), grid: { stroke: style("--grid"), width: 1 }, ticks: { stroke: style("--rule"), width: 1 }, labelFont: "13px system-ui, sans-serif", font: "12px system-ui, sans-serif" };
    const ticks = (u, values, axis, space, step) => values.map((v) => (v == null ? "" : show(v, step)));
    const room = (u, axis, low, high) => Math.max(50, 14 + 7 * show(high, (high - low) / 10).length);
    const options = {
      width: element.clientWidth || 640,
      height: spec.height,
      scales: {
        x: { time: false, range: (u, low, high) => (u.zoomed || !spec.xRange ? (low === high ? [low - 1, high + 1] : [low, high]) : spec.xRange) },
        // Zoomed in x, y follows what is visible; otherwise markers and fixed ranges are respected.
        y: { range: (u, low, high) => {
          if (!u.zoomed && spec.yRange) return spec.yRange;
          if (!u.zoomed) [low, high] = yAll;
          if (low == null || !Number.isFinite(low)) return [0, 1];
          const slack = high > low ? 0.05 * (high - low) : 0.5 * Math.max(Math.abs(high), 1e-6);
          return [low - slack, high + slack];
        } },
      },
      axes: [
        { ...axis, label: spec.x, values: ticks, space: room, size: 44, labelSize: 20 },
        { ...axis, label: spec.y, values: ticks, size: 72, labelSize: 22 },
      ],
      cursor: { sync: spec.group ? { key: spec.group } : undefined, drag: { x: true, y: false } },
      series: [
        { label: spec.x, value: (u, v) => show(v, (u.scales.x.max - u.scales.x.min) / 1000) },
        ...spec.series.map((s, i) => ({
          label: s.name,
          stroke: colour(s, i),
          width: 1.5,
          dash: s.dashed ? [6, 4] : undefined,
          spanGaps: false,
          points: { show: false },
          value: (u, v) => show(v),
          paths: loose(s) ? () => null : s.style === "steps" ? uPlot.paths.stepped({ align: 1 }) : undefined,
        })),
      ],
      hooks: {
        draw: [drawLoose],
        setSelect: [(u) => { if (u.select.width > 0) u.zoomed = true; }],
      },
    };
    const data = aligned(spec);
    const u = new uPlot(options, data, element);
    u.over.addEventListener("dblclick", () => { u.zoomed = false; }, true);
    const resized = new ResizeObserver(() => {
      const width = element.clientWidth;
      if (width && Math.abs(width - u.width) > 1) u.setSize({ width, height: spec.height });
    });
    resized.observe(element);
    return () => { resized.disconnect(); u.destroy(); };
  };

  let remove = [];
  const drawAll = () => {
    remove.forEach((one) => one());
    remove = [];
    for (const element of document.querySelectorAll("[data-plot]")) {
      try {
        remove.push(draw(element, plots[+element.dataset.plot]));
      } catch (error) {
        element.textContent = "This plot could not be drawn: " + error;
      }
    }
  };
  drawAll();
  dark.addEventListener("change", drawAll);
})();
