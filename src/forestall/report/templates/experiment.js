(function () {
  var form = document.getElementById("filters");
  var table = document.getElementById("episodes-table");
  if (!form || !table) { return; }
  var rows = Array.prototype.slice.call(table.tBodies[0].rows);
  var fields = Array.prototype.slice.call(form.querySelectorAll("select"));
  var words = form.querySelector("input");
  var count = form.querySelector("output");
  function apply() {
    var text = words.value.toLowerCase();
    var shown = 0;
    rows.forEach(function (row) {
      var fits = fields.every(function (field) {
        return !field.value || row.cells[+field.dataset.column].dataset.value === field.value;
      });
      fits = fits && (!text || row.textContent.toLowerCase().indexOf(text) >= 0);
      row.hidden = !fits;
      shown += fits ? 1 : 0;
    });
    count.textContent = shown + " of " + rows.length + " episodes";
  }
  form.hidden = false;
  form.addEventListener("input", apply);
  form.addEventListener("submit", function (event) { event.preventDefault(); });
  apply();
}());
