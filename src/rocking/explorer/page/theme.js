// Colours of the plots: those of the style sheet, which follow the system's light or dark.

const dark = window.matchMedia("(prefers-color-scheme: dark)");
/** @type {Set<() => void>} */
const followers = new Set();
dark.addEventListener("change", () => followers.forEach((follow) => follow()));

/** @param {string} name */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

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
  for (const axis of [...made.below, ...made.left]) if (axis.type === "LinearAxis") axis.formatter = new (bokeh().BasicTickFormatter)({power_limit_low: -3, power_limit_high: 6});
  themed(() => {
    const ink = colour("ink"), soft = colour("soft"), grid = colour("grid");
    made.setv({background_fill_color: colour("paper"), border_fill_color: colour("paper")});
    for (const axis of [...made.below, ...made.left]) {
      axis.setv({
        axis_line_color: soft, major_tick_line_color: soft, minor_tick_line_color: null, major_label_text_color: ink,
        axis_label_text_color: ink, major_label_text_font_size: "12px", axis_label_text_font_size: "12px",
        axis_label_text_font_style: "normal", axis_label_text_font: "system-ui, sans-serif", major_label_text_font: "system-ui, sans-serif",
        axis_label_standoff: 8,
      });
    }
    for (const each of made.center) if (each.type === "Grid") each.setv({grid_line_color: grid});
  });
  return made;
}

/** Whether the pointer is a finger: then dragging scrolls the page. */
export const coarse = () => window.matchMedia("(pointer: coarse)").matches;
