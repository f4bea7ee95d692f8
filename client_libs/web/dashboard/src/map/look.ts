/** How all of the map is painted. */
export interface Look {
  dark: boolean;
  /** Of lines and letters. */
  scale: number;
}
