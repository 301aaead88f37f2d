model Heater "a heater with its loss to the room"
  final parameter Real C(unit="J/K") = 2.0 "heat capacity of the heater with its sensor: 4 g of 500 J/(kg.K)";
  parameter Real g(unit="W", min=0, max=1) = 0.01 "power, per percent";
  parameter Real k(unit="W/K", min=0, max=1) = 0.015 "loss to the room";
  parameter Real Ta(unit="degC", min=15, max=27) = 21 "room, which was not measured";
  input Real Q(unit="%") "heater";
  output Real y(unit="degC") = T "sensor";
  Real T(unit="degC", start=21) "heater";
equation
  C*der(T) = g*Q - k*(T - Ta);
end Heater;
