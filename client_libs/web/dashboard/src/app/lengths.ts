/** The longest of 1, 2, 5, 10, ... metres (also parts of one) that is not longer than this. */
export function roundLength(longest: number): number {
  const power = 10 ** Math.floor(Math.log10(longest));
  const times = longest / power;
  return power * (times >= 5 ? 5 : times >= 2 ? 2 : 1);
}

export function formatLength(metres: number): string {
  if (metres >= 1000) return `${metres / 1000} km`;
  return metres >= 1 ? `${metres} m` : `${Math.round(metres * 1000) / 10} cm`;
}
