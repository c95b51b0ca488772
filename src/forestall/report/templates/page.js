(function () {
  function show() {
    var place = location.hash && document.getElementById(location.hash.slice(1));
    var box = place && place.querySelector("details");
    if (box) { box.open = true; place.scrollIntoView(); }
  }
  window.addEventListener("hashchange", show);
  show();
  var all = document.getElementById("unfold");
  if (!all) { return; }
  var cards = document.querySelectorAll("details.moment");
  all.hidden = false;
  all.addEventListener("click", function () {
    var open = all.getAttribute("aria-pressed") !== "true";
    all.setAttribute("aria-pressed", String(open));
    all.textContent = open ? "Fold all" : "Unfold all";
    cards.forEach(function (card) { card.open = open; });
  });
}());
