model TwoHeaters "two heaters on one board, each with its own loss to the room"
  final parameter Real C(unit="J/K") = 2.0 "heat capacity of a heater with its sensor: 4 g of 500 J/(kg.K)";
  parameter Real g1(unit="W", min=0, max=1) = 0.01 "power of heater 1, per percent";
  parameter Real g2(unit="W", min=0, max=1) = 0.007 "power of heater 2, per percent";
  parameter Real k1(unit="W/K", min=0, max=1) = 0.015 "loss of heater 1 to the room";
  parameter Real k2(unit="W/K", min=0, max=1) = 0.015 "loss of heater 2 to the room";
  parameter Real Ta(unit="degC", min=15, max=27) = 21 "room, which was not measured";
  input Real Q1(unit="%") "heater 1";
  input Real Q2(unit="%") "heater 2";
  output Real y1(unit="degC") = T1 "sensor 1";
  output Real y2(unit="degC") = T2 "sensor 2";
  Real T1(unit="degC", start=21) "heater 1";
  Real T2(unit="degC", start=21) "heater 2";
equation
  C*der(T1) = g1*Q1 - k1*(T1 - Ta);
  C*der(T2) = g2*Q2 - k2*(T2 - Ta);
end TwoHeaters;
