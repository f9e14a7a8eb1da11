// Colours of the plots: those of the style sheet, which follow the system's light or dark.

import {plain} from "./ticks.js";

/** @type {Set<() => void>} */
const followers = new Set();
/** Where a label of usual size would be longer than its axis. */
const narrow = window.matchMedia("(max-width: 420px)");
const forced = window.matchMedia("(forced-colors: active)");
for (const query of [window.matchMedia("(prefers-color-scheme: dark)"), forced]) query.addEventListener("change", () => followers.forEach((follow) => follow()));

/** Pixels of a canvas in one of the page, at least so many for a printer. */
export const sharpness = () => Math.max(window.devicePixelRatio || 1, printed ? 3 : 1);

/** How many times as large as usual the text of the plots is. */
let enlarged = 1;
/** Size of a text of the plots, px. @param {number} usual */
export const textSize = (usual) => Math.round(usual * enlarged);

/** Draw the text of all plots so many times as large. @param {number} times */
export function enlarge(times) {
  enlarged = times;
  followers.forEach((follow) => follow());
}

/** @param {string} name */
export function colour(name) {
  const found = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  return forced.matches ? resolved(found) : found;
}

/** A colour of the system, which the plots do not know by its name, as numbers. @param {string} name */
function resolved(name) {
  const probe = document.head;
  probe.style.color = name;
  const found = getComputedStyle(probe).color;
  probe.style.color = "";
  return found;
}

/** Call now, and again whenever the colours change. @param {() => void} follow */
export function themed(follow) {
  followers.add(follow);
  follow();
}

let printed = false;
/** Draw in light, for paper, or in the system's colours again. @param {boolean} on */
export function lit(on) {
  if (printed === on) return;
  printed = on;
  document.documentElement.classList.toggle("lit", on);
  followers.forEach((follow) => follow());
}

/** Bokeh, which a script before this one has loaded. @returns {any} */
export const bokeh = () => /** @type {any} */ (window).Bokeh;

/** A bare figure whose axes follow the theme. @param {Record<string, any>} given @param {string} label */
export function figure(given, label) {
  const made = new (bokeh().Plotting.Figure)({
    toolbar_location: null, tools: [], sizing_mode: "stretch_width", min_border_left: 62, min_border_right: 14,
    min_border_top: 6, min_border_bottom: 4, outline_line_color: null,
    html_attributes: {role: "img", "aria-label": label}, ...given,
  });
  for (const axis of [...made.below, ...made.left]) if (axis.type === "LinearAxis") axis.formatter = plain(new (bokeh().BasicTickFormatter)());
  themed(() => {
    const ink = colour("ink"), soft = colour("soft"), grid = colour("grid");
    made.setv({background_fill_color: colour("paper"), border_fill_color: colour("paper"), min_border_left: enlarged > 1 ? 118 : 62});
    for (const axis of [...made.below, ...made.left]) {
      axis.setv({
        axis_line_color: soft, major_tick_line_color: soft, minor_tick_line_color: null, major_label_text_color: ink,
        axis_label_text_color: ink, major_label_text_font_size: `${textSize(12)}px`, axis_label_text_font_size: `${textSize(narrow.matches ? 11 : 12)}px`,
        axis_label_text_font_style: "normal", axis_label_text_font: "system-ui, sans-serif", major_label_text_font: "system-ui, sans-serif",
        axis_label_standoff: 8, major_label_policy: new (bokeh().NoOverlap)({min_distance: textSize(6)}),
      });
    }
    for (const each of made.center) if (each.type === "Grid") each.setv({grid_line_color: grid});
  });
  return made;
}

/** Keep Bokeh from asking the style sheet (--bk-...) for each colour and width of an axis at every painting: this page has none there.
 * @param {any} view of a plot or of several */
function askNoStyleSheet(view) {
  for (let kind of Object.values(view?.visuals ?? {})) {
    while (kind && !Object.hasOwn(kind, "_get_css_value")) kind = Object.getPrototypeOf(kind);
    if (kind) { kind._get_css_value = () => ""; return; }
  }
  for (const each of view?.child_views ?? []) askNoStyleSheet(each);
}

/** Put a plot into an element. Keys go to the element: within the plot the keyboard does not stop, where nobody would see it.
 * @param {any} plot @param {HTMLElement} element */
export async function showPlot(plot, element) {
  element.inert = true; // until the keyboard does not stop there any more
  await bokeh().Plotting.show(plot, element);
  askNoStyleSheet(bokeh().index.find_one(plot));
  /** @param {Element | ShadowRoot} node */
  const pass = (node) => {
    for (const each of node.children) {
      if (each instanceof HTMLElement && each.tabIndex === 0) each.tabIndex = -1;
      pass(each.shadowRoot ?? each);
    }
  };
  pass(element);
  element.inert = false;
}

/** Whether the pointer is a finger: then dragging scrolls the page. */
export const coarse = () => window.matchMedia("(pointer: coarse)").matches;
