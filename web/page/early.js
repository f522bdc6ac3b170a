// Runs before the page is drawn: where pictures are kept or shared, there is room for them at once.
try {
  if (localStorage.getItem("has-pictures") || location.search === "?shared") document.documentElement.classList.add("has-pictures");
} catch { /* a browser without storage keeps none */ }
