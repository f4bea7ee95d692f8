import js from '@eslint/js';
import ts from 'typescript-eslint';

export default ts.config(
  { ignores: ['**/dist/', '**/gen/', 'gateway/'] },
  js.configs.recommended,
  ts.configs.strict,
  {
    rules: {
      // The type checker finds undefined names. Reading a signal subscribes an effect to it, so such
      // an expression is not unused.
      'no-undef': 'off',
      '@typescript-eslint/no-unused-expressions': 'off',
      '@typescript-eslint/no-unused-vars': ['error', { argsIgnorePattern: '^_' }],
    },
  },
);
