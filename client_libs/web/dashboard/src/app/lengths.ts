/**
 * Returns the largest length of 1, 2 or 5 times a power of ten that is at most `longest`, metres.
 */
export function roundLength(longest: number): number {
  const power = 10 ** Math.floor(Math.log10(longest));
  const times = longest / power;
  return power * (times >= 5 ? 5 : times >= 2 ? 2 : 1);
}

/** Formats a round length with the unit that suits it: "20 cm", "5 m", "1 km". */
export function formatLength(metres: number): string {
  if (metres >= 1000) return `${metres / 1000} km`;
  return metres >= 1 ? `${metres} m` : `${Math.round(metres * 1000) / 10} cm`;
}
