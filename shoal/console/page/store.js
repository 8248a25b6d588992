// What is known: the latest state of each vehicle, and what the operator has chosen.
const STALE = 3; // s without data

// An object by names of the network, any of which may be `constructor` or `__proto__`: it inherits nothing.
const byName = (...from) => Object.assign(Object.create(null), ...from);

// `byUser`: whether the operator, not this page, has chosen the vehicle.
export const store = {
  vehicles: byName(), tracks: byName(), log: [], values: byName(), leases: byName(), panelFields: [],
  now: 0, replay: null, chosen: "", byUser: false, socket: null, drawing: false, measuring: false,
  vehicle: () => store.vehicles[store.chosen],
};

// s since a position was received
const ageOf = (state) => Number.isFinite(state?.time) ? store.now - state.time : 0;
const isOld = ({ system, state }) => !system?.there || ageOf(state) > STALE;
const placeOf = (state) => Number.isFinite(state?.lat) && Number.isFinite(state.lon) ? [state.lat, state.lon] : null;
export { STALE, ageOf, byName, isOld, placeOf };
