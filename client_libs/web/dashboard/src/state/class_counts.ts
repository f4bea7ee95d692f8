import type { Object$ } from './model';

export interface ClassCount {
  label: string;
  count: number;
}

/** Counts the objects of each class; the most frequent class comes first. */
export function classCounts(objects: Iterable<Object$>): ClassCount[] {
  const counts = new Map<string, number>();
  for (const { label } of objects) counts.set(label, (counts.get(label) ?? 0) + 1);
  return [...counts]
    .map(([label, count]) => ({ label, count }))
    .sort((a, b) => b.count - a.count || a.label.localeCompare(b.label));
}
