// Where vehicles have been: { points: [[lat, lon, depth]], dropped, time } by name.
import { byName, placeOf } from "./page.js";

const PERIOD = 1; // s between points
const MOST = 18000; // points
const PART = 1800; // points dropped at once: the map then draws all anew

// The tracks that the console has kept.
export function tracksOf(given) {
  const tracks = byName();
  for (const [name, points] of Object.entries(given)) tracks[name] = trackOf(points);
  return tracks;
}

export function extendTrack(tracks, name, state, now) {
  if (!placeOf(state)) return;
  const track = tracks[name] ??= trackOf([]);
  if (Math.abs(now - track.time) < PERIOD) return; // not only later: a clock may be set back
  // Coarse: the last digits change also of a vehicle that does not move.
  const point = [rounded(state.lat, 6), rounded(state.lon, 6), rounded(state.depth, 1)];
  if (track.points.at(-1)?.every((number, at) => number === point[at])) return;
  track.time = now;
  track.points.push(point);
  if (track.points.length > MOST) {
    track.points.splice(0, PART);
    track.dropped += PART;
  }
}

const trackOf = (points) => ({ points, dropped: 0, time: 0 });
const rounded = (number, digits) => Number.isFinite(number) ? Number(number.toFixed(digits)) : null;
