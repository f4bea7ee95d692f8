import { expect, test } from 'vitest';
import { asking } from './asking';

/** A question that the test answers. */
function later<T>() {
  let tell: (answer: T) => void = () => undefined;
  let fail: (error: unknown) => void = () => undefined;
  const answer = new Promise<T>((resolve, reject) => ([tell, fail] = [resolve, reject]));
  let signal: AbortSignal | undefined;
  const question = (given: AbortSignal) => {
    signal = given;
    return answer;
  };
  return { question, tell, fail, isAborted: () => signal?.aborted };
}

test('an answer is kept until the next one arrives', async () => {
  const asked = asking<string>();
  const [first, second] = [later<string>(), later<string>()];
  const done = asked.ask(first.question);
  expect(asked.busy.value).toBe(true);
  first.tell('one');
  expect(await done).toBe('one');
  expect(asked.busy.value).toBe(false);

  const next = asked.ask(second.question);
  expect(asked.answer.value).toBe('one');
  second.tell('two');
  await next;
  expect(asked.answer.value).toBe('two');
});

test('a late answer to an earlier question is ignored', async () => {
  const asked = asking<string>();
  const [first, second] = [later<string>(), later<string>()];
  const [one, two] = [asked.ask(first.question), asked.ask(second.question)];
  expect(first.isAborted()).toBe(true);
  second.tell('two');
  await two;
  first.tell('one');
  expect(await one).toBeUndefined();
  expect(asked.answer.value).toBe('two');
});

test('an error is kept until the next question', async () => {
  const asked = asking<string>();
  const [first, second] = [later<string>(), later<string>()];
  const done = asked.ask(first.question);
  first.fail(new Error('no map of that name'));
  await done;
  expect(asked.problem.value).toBe('no map of that name');
  expect(asked.answer.value).toBeUndefined();

  const next = asked.ask(second.question);
  expect(asked.problem.value).toBeUndefined();
  asked.forget();
  second.tell('too late');
  expect(await next).toBeUndefined();
  expect(asked.answer.value).toBeUndefined();
  expect(asked.busy.value).toBe(false);
});
