(function () {
  "use strict";
  var WIDE = 480, HIGH = 340, TURN = Math.PI / 24;
  var FACES = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
  var PITCH = 0.62, MOST_NAME = 22;

  function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  function minus(a, b) { return [a[0] - b[0], a[1] - b[1], a[2] - b[2]]; }

  function element(name, to, attributes, text) {
    var made = document.createElementNS(to.namespaceURI, name);
    Object.keys(attributes || {}).forEach(function (key) {
      made.setAttribute(key, attributes[key]);
    });
    if (text !== undefined) { made.textContent = text; }
    return to.appendChild(made);
  }

  function read(box) {
    var low = box.slice(3, 6), high = box.slice(6, 9), corners = [];
    for (var k = 0; k < 8; k += 1) {
      corners.push([k & 1 ? high[0] : low[0], k & 2 ? high[1] : low[1], k & 4 ? high[2] : low[2]]);
    }
    var middle = [0, 1, 2].map(function (i) { return (low[i] + high[i]) / 2; });
    return { id: box[0], words: box[1], looks: box[2], low: low, high: high, corners: corners,
      middle: middle, near: box[2].indexOf("near") === 0 };
  }

  function bounds(boxes) {
    var low = [0, 1, 2].map(function (i) {
      return Math.min.apply(null, boxes.map(function (b) { return b.low[i]; })); });
    var high = [0, 1, 2].map(function (i) {
      return Math.max.apply(null, boxes.map(function (b) { return b.high[i]; })); });
    var size = minus(high, low);
    return { middle: [0, 1, 2].map(function (i) { return (low[i] + high[i]) / 2; }),
      radius: Math.max(0.15, Math.sqrt(dot(size, size)) / 2) };
  }

  function camera(view) {
    var c = Math.cos(view.pitch), f = [Math.cos(view.yaw) * c, Math.sin(view.yaw) * c,
      -Math.sin(view.pitch)];
    var right = [Math.sin(view.yaw), -Math.cos(view.yaw), 0];
    var up = [right[1] * f[2] - right[2] * f[1], right[2] * f[0] - right[0] * f[2],
      right[0] * f[1] - right[1] * f[0]];
    var away = 4 * view.radius, eye = view.middle.map(function (m, i) { return m - away * f[i]; });
    var scale = view.zoom * away * 0.46 * HIGH / view.radius;
    return {
      eye: eye,
      place: function (point) {
        var d = minus(point, eye), depth = dot(d, f);
        if (depth < 0.05 * view.radius) { return null; }
        return { x: WIDE / 2 + scale * dot(d, right) / depth,
          y: HIGH / 2 - scale * dot(d, up) / depth, depth: depth };
      }
    };
  }

  function line(to, look, a, b) {
    if (a && b) {
      element("line", to, { "class": look, x1: a.x.toFixed(1), y1: a.y.toFixed(1),
        x2: b.x.toFixed(1), y2: b.y.toFixed(1) });
    }
  }

  function floor(to, eye, scene) {
    var m = scene.middle, step = scene.radius > 2 ? 1 : scene.radius > 0.6 ? 0.5 : 0.1;
    var x = Math.round(m[0] / step) * step, y = Math.round(m[1] / step) * step;
    for (var k = -4; k <= 4; k += 1) {
      line(to, "sp-floor", eye.place([x + k * step, y - 4 * step, scene.floor]),
        eye.place([x + k * step, y + 4 * step, scene.floor]));
      line(to, "sp-floor", eye.place([x - 4 * step, y + k * step, scene.floor]),
        eye.place([x + 4 * step, y + k * step, scene.floor]));
    }
  }

  function solid(to, eye, box) {
    var at = box.corners.map(eye.place);
    if (at.indexOf(null) >= 0) { return; }
    var group = element("g", to, { "class": "sp-box " + box.looks, "data-node": box.id });
    element("title", group, {}, box.id + ": " + box.words);
    FACES.forEach(function (face, k) {
      var axis = k >> 1, beyond = k & 1 ? eye.eye[axis] > box.high[axis] :
        eye.eye[axis] < box.low[axis];
      if (!beyond) { return; }
      element("polygon", group, { points: face.map(function (i) {
        return at[i].x.toFixed(1) + "," + at[i].y.toFixed(1); }).join(" ") });
    });
  }

  function words(to, taken, look, text, at, always) {
    if (!at) { return; }
    var cut = text.length > MOST_NAME ? text.slice(0, MOST_NAME - 1) + "…" : text;
    var half = 3.4 * cut.length + 3, x = Math.min(Math.max(at.x, half), WIDE - half), y = at.y;
    var mine = [x - half, y - 11, x + half, y + 4];
    var free = taken.every(function (t) {
      return mine[2] < t[0] || mine[0] > t[2] || mine[3] < t[1] || mine[1] > t[3]; });
    if (!free && !always) { return; }
    taken.push(mine);
    element("text", to, { "class": look, x: x.toFixed(1), y: y.toFixed(1) }, cut);
  }

  function draw(scene) {
    var svg = scene.svg, eye = scene.eye = camera(scene);
    svg.textContent = "";
    floor(element("g", svg), eye, scene);
    scene.order = scene.boxes.map(function (box) {
      return { box: box, at: eye.place(box.middle) };
    }).filter(function (o) { return o.at; });
    scene.order.sort(function (a, b) { return b.at.depth - a.at.depth; });
    scene.order.forEach(function (o) { solid(svg, eye, o.box); });
    scene.lines = element("g", svg, { "class": "sp-lines" });
    mark(scene);
  }

  function mark(scene) {
    var eye = scene.eye, lines = scene.lines, taken = [], boxes = scene.boxes;
    lines.textContent = "";
    scene.svg.querySelectorAll(".sp-box").forEach(function (box) {
      box.classList.toggle("pointed", box.getAttribute("data-node") === scene.pointed);
    });
    var shown = scene.relations.filter(function (r) {
      var ends = [boxes[r[0]], boxes[r[1]]];
      var touched = ends.some(function (b) { return b.id === scene.pointed; });
      return touched || (r[3] && ends[0].near && ends[1].near && !scene.pointed);
    });
    shown.forEach(function (r) {
      line(lines, "sp-relation", eye.place(boxes[r[0]].middle), eye.place(boxes[r[1]].middle));
    });
    names(scene, taken);
    shown.forEach(function (r) {
      var a = eye.place(boxes[r[0]].middle), b = eye.place(boxes[r[1]].middle);
      words(lines, taken, "sp-said", r[2], a && b && { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 },
        false);
    });
  }

  function names(scene, taken) {
    var eye = scene.eye, lines = scene.lines;
    function rank(o) {
      return (o.box.id === scene.pointed ? 0 : 4) + (/culprit/.test(o.box.looks) ? 0 : 2);
    }
    var named = scene.order.filter(function (o) {
      return o.box.near || o.box.id === scene.pointed;
    });
    named.sort(function (a, b) { return rank(a) - rank(b) || a.at.depth - b.at.depth; });
    named.forEach(function (o) {
      var at = eye.place([o.box.middle[0], o.box.middle[1], o.box.high[2]]);
      words(lines, taken, "sp-name " + o.box.looks, o.box.id, at && { x: at.x, y: at.y - 5 },
        o.box.id === scene.pointed);
    });
    if (scene.robot) {
      var top = eye.place([scene.robot[0], scene.robot[1], scene.floor + 1]);
      line(lines, "sp-robot", eye.place([scene.robot[0], scene.robot[1], scene.floor]), top);
      words(lines, taken, "sp-name sp-self", "robot", top, false);
    }
  }

  function first(scene) {
    var fit = bounds(scene.boxes.filter(function (b) { return b.near; }).length ?
      scene.boxes.filter(function (b) { return b.near; }) : scene.boxes);
    scene.middle = fit.middle;
    scene.radius = fit.radius;
    scene.yaw = scene.facing === null ? 0.8 : scene.facing;
    scene.pitch = PITCH;
    scene.zoom = 1;
  }

  function turn(scene, yaw, pitch, zoom) {
    scene.yaw += yaw;
    scene.pitch = Math.min(1.5, Math.max(-0.2, scene.pitch + pitch));
    scene.zoom = Math.min(6, Math.max(0.2, scene.zoom * zoom));
    draw(scene);
  }

  function does(scene, what) {
    var known = { ArrowLeft: [-TURN, 0, 1], ArrowRight: [TURN, 0, 1], ArrowUp: [0, TURN, 1],
      ArrowDown: [0, -TURN, 1], "+": [0, 0, 1.2], "=": [0, 0, 1.2], "-": [0, 0, 1 / 1.2] };
    if (what === "Home") { first(scene); draw(scene); return true; }
    if (!known[what]) { return false; }
    turn.apply(null, [scene].concat(known[what]));
    return true;
  }

  function listen(scene, figure) {
    var from = null, svg = scene.svg;
    figure.addEventListener("keydown", function (event) {
      if (event.altKey || event.ctrlKey || event.metaKey) { return; }
      if (does(scene, event.key)) { event.preventDefault(); }
    });
    figure.addEventListener("click", function (event) {
      var button = event.target.closest("button");
      if (button) { does(scene, button.getAttribute("data-key")); }
    });
    svg.addEventListener("pointerdown", function (event) {
      from = [event.clientX, event.clientY];
      svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", function (event) {
      if (!from) { return; }
      turn(scene, (from[0] - event.clientX) / 120, (event.clientY - from[1]) / 160, 1);
      from = [event.clientX, event.clientY];
    });
    ["pointerup", "pointercancel"].forEach(function (kind) {
      svg.addEventListener(kind, function () { from = null; });
    });
    figure.closest("article").addEventListener("pointed", function (event) {
      if (!from && scene.pointed !== event.detail) {
        scene.pointed = event.detail;
        mark(scene);
      }
    });
  }

  function begin(figure) {
    var told = JSON.parse(figure.querySelector("script").textContent);
    var boxes = told.boxes.map(read);
    var scene = { svg: figure.querySelector("svg"), boxes: boxes, relations: told.relations,
      robot: told.robot, facing: told.yaw, pointed: null };
    scene.floor = Math.min.apply(null, boxes.map(function (b) { return b.low[2]; }).concat(
      told.robot ? [0] : []));
    first(scene);
    listen(scene, figure);
    draw(scene);
  }

  function show(card) {
    card.querySelectorAll(".space[hidden]").forEach(function (figure) {
      figure.hidden = false;
      begin(figure);
    });
  }

  document.addEventListener("toggle", function (event) {
    if (event.target.open) { show(event.target); }
  }, true);
  document.querySelectorAll("details.moment[open]").forEach(show);
}());
