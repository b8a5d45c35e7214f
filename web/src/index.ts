/**
 * IPDRecon for web pages: `<ipd-recon>` (defined by importing this), the {@link Reconstructor} behind it for pages that bring
 * their own everything, and the types of the protocol, which are generated from the engine's source.
 */
import { defineIpdRecon } from "./element.js";

export * from "./client.js";
export { collect, DropError, type Droppable, type Dropped, type Unreadable } from "./drop.js";
export { defineIpdRecon, IpdReconElement, type IpdReconEventMap, type OpenOptions } from "./element.js";
export { preflight, type Shortcoming } from "./preflight.js";
export { amount, count, counted, stageOrder, stageTitle } from "./words.js";
export type {
  DepthSource,
  DeviceChoice,
  Event as EngineEvent,
  FindingMessage,
  InputEvent,
  LookAt,
  MeshFormat,
  PixelSize,
  PlanSummary,
  PresetName,
  Request as EngineRequest,
  RunOptions,
  ShadingMode,
  StageName,
  ViewOptions,
  WeightsAddress,
} from "./engine.js";

/** The version of this package. */
export const version = "0.1.0";

defineIpdRecon();
