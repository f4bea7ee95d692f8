/** Properties of the screen that all layers are painted for. */
export interface Look {
  dark: boolean;
  /** The scale of lines and text, see scale.ts. */
  scale: number;
}
