import { afterEach, beforeEach, expect, it, vi } from 'vitest';
import { Throttle } from './throttle';

beforeEach(() => vi.useFakeTimers());
afterEach(() => vi.useRealTimers());

it('runs at once, and once more for all requests in the meantime', async () => {
  let runs = 0;
  const throttle = new Throttle(1000, async () => void runs++);
  throttle.ask();
  throttle.ask();
  throttle.ask();
  expect(runs).toBe(1);
  await vi.advanceTimersByTimeAsync(999);
  expect(runs).toBe(1);
  await vi.advanceTimersByTimeAsync(1);
  expect(runs).toBe(2);
  await vi.advanceTimersByTimeAsync(5000);
  expect(runs).toBe(2);
  throttle.ask();
  expect(runs).toBe(3);
});

it('never runs twice at once', async () => {
  let running = 0;
  let most = 0;
  const throttle = new Throttle(10, async () => {
    most = Math.max(most, ++running);
    await new Promise((resolve) => setTimeout(resolve, 100));
    running--;
  });
  for (let i = 0; i < 20; i++) {
    throttle.ask();
    await vi.advanceTimersByTimeAsync(15);
  }
  expect(most).toBe(1);
});

it('does nothing after its end', async () => {
  let runs = 0;
  const throttle = new Throttle(10, async () => void runs++);
  throttle.ask();
  throttle.ask();
  throttle.end();
  await vi.advanceTimersByTimeAsync(100);
  throttle.ask();
  expect(runs).toBe(1);
});
