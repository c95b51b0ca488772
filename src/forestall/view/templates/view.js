(function () {
  "use strict";
  var events = null;

  function form() {
    var filters = document.getElementById("filters");
    if (filters) { document.getElementById("show").hidden = true; }
    choose();
  }

  function picked() {
    return Array.prototype.slice.call(document.querySelectorAll("input[name=run]:checked"));
  }

  function choose() {
    var button = document.getElementById("compare");
    if (button) { button.disabled = picked().length !== 2; }
  }

  document.addEventListener("change", function (event) {
    var target = event.target;
    if (target.name === "run") { choose(); }
    else if (target.tagName === "SELECT" && target.form.id === "filters") { target.form.submit(); }
  });

  function swap(text) {
    var next = new DOMParser().parseFromString(text, "text/html");
    if (!next.querySelector("link[href='/view.css']")) { location.reload(); return; }
    var chosen = picked().map(function (box) { return box.value; });
    var focus = document.activeElement && document.activeElement.id;
    document.querySelector("main").replaceWith(next.querySelector("main"));
    document.title = next.title;
    document.querySelectorAll("input[name=run]").forEach(function (box) {
      box.checked = chosen.indexOf(box.value) >= 0;
    });
    form();
    if (focus && document.getElementById(focus)) {
      document.getElementById(focus).focus({ preventScroll: true });
    }
    follow(next.body.getAttribute("data-follow"));
  }

  function again() {
    fetch(location.href, { cache: "no-store" })
      .then(function (answer) { return answer.text(); })
      .then(swap)
      .catch(function () { setTimeout(again, 2000); });
  }

  function follow(where) {
    if (events) { events.close(); events = null; }
    if (!where) { return; }
    events = new EventSource(where);
    events.addEventListener("changed", function () {
      events.close();
      events = null;
      again();
    });
  }

  window.addEventListener("pageshow", form);
  form();
  follow(document.body.getAttribute("data-follow"));
}());
