model Groundwater "groundwater between rain, evaporation and one drain"
  parameter Real S(unit="1", min=0.01, max=0.6) = 0.2 "share of the soil that fills and empties";
  parameter Real c(unit="d", min=1, max=10000) = 200 "resistance of the drain";
  parameter Real base(unit="m", min=10, max=25) = 18.5 "level of the drain";
  input Real P(unit="m/d") "rain";
  input Real E(unit="m/d") "evaporation";
  output Real y(unit="m") = h "head in the well";
  Real h(unit="m", start=19.4) "head";
equation
  S*der(h) = P - E - (h - base)/c;
end Groundwater;
