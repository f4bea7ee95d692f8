import { Code, ConnectError } from '@hypermap/client';
import { expect, test } from 'vitest';
import { messageOf } from './connection';

test('only the message of a fault of the server tells the name of the call in its log', () => {
  const named = { 'x-request-id': '0123456789abcdef' };
  expect(messageOf(new ConnectError('a page is torn', Code.DataLoss, named))).toBe(
    "a page is torn (call 0123456789abcdef in the server's log)",
  );
  expect(messageOf(new ConnectError('a page is torn', Code.DataLoss))).toBe('a page is torn');
  expect(messageOf(new ConnectError('no map hall', Code.NotFound, named))).toBe('no map hall');
});
