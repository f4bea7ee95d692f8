/** The date and time of day, as people here write them. */
export function formatTime(time: Date): string {
  return time.toLocaleString(undefined, { dateStyle: 'medium', timeStyle: 'medium' });
}
