(function () {
  var cards = Array.prototype.slice.call(document.querySelectorAll("article[id^=moment-]"));
  var links = document.querySelectorAll(".strip a");
  var now = -1, unfolded = null;

  function box(card) { return card.querySelector("details.moment"); }

  function mark(to) {
    now = to;
    links.forEach(function (link, k) {
      if (k === to) { link.setAttribute("aria-current", "step"); }
      else { link.removeAttribute("aria-current"); }
    });
    document.getElementById("where").textContent = (to + 1) + " of " + cards.length;
    document.getElementById("back").disabled = to <= 0;
    document.getElementById("forth").disabled = to >= cards.length - 1;
  }

  function go(to, focus) {
    if (to < 0 || to >= cards.length) { return; }
    if (unfolded) { unfolded.open = false; unfolded = null; }
    var here = box(cards[to]);
    if (!here.open) { here.open = true; unfolded = here; }
    mark(to);
    if (focus) { here.querySelector("summary").focus({ preventScroll: true }); }
    cards[to].scrollIntoView();
  }

  function show() {
    var place = location.hash && document.getElementById(location.hash.slice(1));
    var at = cards.indexOf(place);
    if (at >= 0) { box(place).open = true; mark(at); place.scrollIntoView(); }
  }

  function busy(target) {
    var scroll = target.closest && target.closest(".scroll");
    return (scroll && scroll.scrollWidth > scroll.clientWidth) || target.closest(".space") ||
      /^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName);
  }

  window.addEventListener("hashchange", show);
  var all = document.getElementById("unfold");
  if (all && cards.length) {
    document.getElementById("scrub").hidden = false;
    document.getElementById("back").addEventListener("click", function () { go(now - 1, false); });
    document.getElementById("forth").addEventListener("click", function () { go(now + 1, false); });
    document.addEventListener("keydown", function (event) {
      var step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step || event.altKey || event.ctrlKey || event.metaKey || event.shiftKey ||
          busy(event.target)) { return; }
      event.preventDefault();
      go(now + step, true);
    });
    cards.forEach(function (card, k) {
      card.addEventListener("focusin", function () { if (k !== now) { mark(k); } });
    });
    all.hidden = false;
    all.addEventListener("click", function () {
      var open = all.getAttribute("aria-pressed") !== "true";
      all.setAttribute("aria-pressed", String(open));
      all.textContent = open ? "Fold all" : "Unfold all";
      unfolded = null;
      cards.forEach(function (card) { box(card).open = open; });
    });
  }
  show();

  function point(event) {
    var node = event.target.closest && event.target.closest("article [data-node]");
    if (!node) { return; }
    var on = event.type === "mouseover" || event.type === "focusin";
    var card = node.closest("article"), name = node.getAttribute("data-node");
    var seen = card.querySelector(".seen");
    if (seen) { seen.classList.toggle("pointing", on); }
    card.querySelectorAll(".box, .fg-placed").forEach(function (one) {
      one.classList.toggle("pointed", on && one.getAttribute("data-node") === name);
    });
    card.dispatchEvent(new CustomEvent("pointed", { detail: on ? name : null }));
  }
  ["mouseover", "mouseout", "focusin", "focusout"].forEach(function (kind) {
    document.addEventListener(kind, point);
  });
}());
