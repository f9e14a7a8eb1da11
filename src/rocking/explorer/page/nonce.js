// The plotting library writes style elements; the page's policy admits those that carry its nonce. At every painting it
// writes most of them anew as they were, which would make the browser compute all styles again: that is left out.
const nonce = /** @type {HTMLScriptElement} */ (document.currentScript).dataset.nonce ?? "";
const createElement = document.createElement.bind(document);
const text = /** @type {PropertyDescriptor} */ (Object.getOwnPropertyDescriptor(Node.prototype, "textContent"));
document.createElement = (/** @type {string} */ name, /** @type {any} */ options) => {
  const made = createElement(name, options);
  if (name.toLowerCase() !== "style") return made;
  made.nonce = nonce;
  let written = "";
  Object.defineProperty(made, "textContent", {
    get: () => written,
    set: (/** @type {string} */ css) => {
      if (css !== written) text.set?.call(made, css);
      written = css;
    },
  });
  return made;
};
