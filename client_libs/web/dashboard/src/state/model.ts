// The protocol types that the dashboard uses.
export {
  AnswerStatus,
  CellRule,
  ChangeKind,
  LayerKind,
  MapState,
  ShapeKind,
  type CellRuns,
  type Change,
  type GridGeometry,
  type Layer,
  type LayerPart,
  type Object$,
  type Polygon,
  type RevisionInfo,
  type Shape,
  type WatchResponse,
} from '@hypermap/client';

/** A position in metres, in the map's own frame. */
export type Position = [x: number, y: number];
