model House "rooms and walls: two resistances, two capacities"
  parameter Real Ci(unit="kW.h/K", min=0) = 5 "rooms: air, furniture, inner walls";
  parameter Real Cw(unit="kW.h/K", min=0) = 15 "outer walls";
  parameter Real Ri(unit="K/kW", min=0) = 2 "from the rooms to the walls";
  parameter Real Ro(unit="K/kW", min=0) = 5 "from the walls to the outside";
  parameter Real A(unit="m2", min=0) = 5 "windows, as seen by the sun";
  input Real P(unit="kW") "heating";
  input Real sun(unit="kW/m2") "on the windows";
  input Real To(unit="degC") "outside";
  output Real y(unit="degC") = Ti;
  Real Ti(unit="degC", start=20) "rooms";
  Real Tw(unit="degC", start=12) "walls";
  Real in_wall(unit="kW") = (Ti - Tw)/Ri;
equation
  Ci*der(Ti) = P + A*sun - in_wall;
  Cw*der(Tw) = in_wall - (Tw - To)/Ro;
end House;
