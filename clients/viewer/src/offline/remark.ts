/** What a copy without a service says of its answers. */

import { centimetres, whole } from "../written.ts";
import type { Tables } from "./read.ts";

export function remark({ accuracy, answers, card }: Tables): string {
  const { beyond, points, typical, worst } = accuracy;
  const curves = card.curves?.length
    ? `; curves lay at most ${(100 * accuracy.curves).toFixed(1)} % of their range off`
    : "";
  const open = (card.labels ?? []).map(({ name }) => name).filter((name) => name !== answers.named);
  const left = open.length ? ` Left open: ${open.join(", ")}.` : "";
  return (
    `This copy works without a service: it interpolates between ${whole(answers.answers)} answers ` +
    `that were computed when it was made. At ${whole(points)} other points, the joint furthest off ` +
    `lay ${centimetres(typical)} from the computed answer in the median and ${centimetres(worst)} ` +
    `at most, ${centimetres(beyond)} outside the sampled ranges${curves}. ` +
    `Measured controls are not corrected.${left}`
  );
}
