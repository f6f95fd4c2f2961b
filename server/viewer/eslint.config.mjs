import tseslint from "typescript-eslint";

export default tseslint.config(...tseslint.configs.recommended, {
    files: ["src/**/*.ts"],
    rules: {
        eqeqeq: "error",
        "no-var": "error",
        "prefer-const": "error",
        "max-lines": ["error", 500],
        "max-lines-per-function": ["error", { max: 100, skipComments: true }],
    },
});
