// Rules for the explorer's page: the recommended set, and what makes plain modules plain. The type checker knows the
// browser's names.
import {createRequire} from "node:module";

const require = createRequire(new URL("../.page-tools/", import.meta.url));

export default [
  {ignores: ["!**/*"]},
  require("@eslint/js").configs.recommended,
  {
    files: ["**/*.js"],
    linterOptions: {reportUnusedDisableDirectives: "error"},
    rules: {
      "no-undef": "off",
      "eqeqeq": "error",
      "no-eval": "error",
      "no-implied-eval": "error",
      "no-var": "error",
      "prefer-const": "error",
      "no-shadow": "error",
      "no-unused-vars": ["error", {varsIgnorePattern: "^_"}],
    },
  },
];
