import js from '@eslint/js';
import ts from 'typescript-eslint';

export default ts.config(
  { ignores: ['**/dist/', '**/gen/', 'gateway/'] },
  js.configs.recommended,
  ts.configs.strict,
  {
    rules: {
      // The type checker knows undefined names better, and reading a signal has an effect.
      'no-undef': 'off',
      '@typescript-eslint/no-unused-expressions': 'off',
      '@typescript-eslint/no-unused-vars': ['error', { argsIgnorePattern: '^_' }],
    },
  },
);
