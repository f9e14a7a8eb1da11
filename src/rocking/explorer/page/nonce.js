// The plotting library writes style elements; the page's policy admits those that carry its nonce.
const nonce = /** @type {HTMLScriptElement} */ (document.currentScript).dataset.nonce ?? "";
const createElement = document.createElement.bind(document);
document.createElement = (/** @type {string} */ name, /** @type {any} */ options) => {
  const made = createElement(name, options);
  if (name.toLowerCase() === "style") made.nonce = nonce;
  return made;
};
